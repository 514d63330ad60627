#include "dyxel/image/image_io.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfTiledOutputFile.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiffio.h>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/image/sampling.h"

namespace dyxel {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class ImageIo : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              (std::string("dyxel_image_io_") +
               ::testing::UnitTest::GetInstance()->current_test_info()->name() + "_" +
               std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_;
};

// Values that tell every pixel and channel apart, exact in half.
ImageF Pattern(int width, int height, int channels) {
  ImageF image(width, height, channels);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < channels; ++c) {
        image.At(x, y, c) = 0.25F * static_cast<float>(x + 3 * y) - 8.0F * static_cast<float>(c);
      }
    }
  }
  return image;
}

void ExpectWindow(const ImageF& part, const ImageF& whole, const Rect& window) {
  ASSERT_EQ(part.width, window.width);
  ASSERT_EQ(part.height, window.height);
  ASSERT_EQ(part.channels, whole.channels);
  for (int y = 0; y < window.height; ++y) {
    for (int x = 0; x < window.width; ++x) {
      for (int c = 0; c < whole.channels; ++c) {
        ASSERT_EQ(part.At(x, y, c), whole.At(window.x + x, window.y + y, c)) << x << " " << y;
      }
    }
  }
}

template <class F>
std::string MessageOf(F&& f) {
  try {
    f();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

void Truncate(const std::filesystem::path& path, double share) {
  std::filesystem::resize_file(
      path,
      static_cast<std::uintmax_t>(static_cast<double>(std::filesystem::file_size(path)) * share));
}

TEST_F(ImageIo, ExrRoundTripOfNamedChannels) {
  const ImageF image = Pattern(37, 70, 5);
  const std::vector<std::string> names = {"kd.R", "alpha", "kd.B", "kd.G", "m"};
  for (const ExrType type : {ExrType::kHalf, ExrType::kFloat}) {
    for (const ExrPacking packing : {ExrPacking::kNone, ExrPacking::kLine, ExrPacking::kBlock}) {
      WriteExr(folder_ / "a.exr", image, names, type, packing);
      const ExrImage all = ReadExr(folder_ / "a.exr", names);
      EXPECT_EQ(all.image.data, image.data);
      const ExrImage rows = ReadExrRows(folder_ / "a.exr", 17, 33, names);
      ExpectWindow(rows.image, image, {0, 17, 37, 16});
    }
  }
  // Without names: all of them, in the file's alphabetical order.
  const ExrImage all = ReadExr(folder_ / "a.exr");
  EXPECT_THAT(all.channels, ElementsAre("alpha", "kd.B", "kd.G", "kd.R", "m"));
  EXPECT_EQ(all.image.At(3, 4, 0), image.At(3, 4, 1));
  EXPECT_EQ(all.image.At(3, 4, 1), image.At(3, 4, 2));
  // One channel, and a window that hangs over the edge.
  const ExrImage part = ReadExr(folder_ / "a.exr", {"m"}, Rect{30, -5, 20, 10});
  EXPECT_EQ(part.image.width, 7);
  EXPECT_EQ(part.image.height, 5);
  EXPECT_EQ(part.image.At(2, 4), image.At(32, 4, 4));
  // The colours are those of the layer.
  const ExrPicture colours = ReadExrRgb(folder_ / "a.exr");
  EXPECT_EQ(colours.image.At(5, 6, 0), image.At(5, 6, 0));
  EXPECT_EQ(colours.image.At(5, 6, 1), image.At(5, 6, 3));
  EXPECT_EQ(colours.image.At(5, 6, 2), image.At(5, 6, 2));
}

TEST_F(ImageIo, ExrFloatKeepsEveryBitAndHalfClamps) {
  ImageF image(3, 1, 1);
  image.data = {1.0000001F, 1e20F, std::numeric_limits<float>::quiet_NaN()};
  WriteExr(folder_ / "f.exr", image, {"Y"}, ExrType::kFloat);
  WriteExr(folder_ / "h.exr", image, {"Y"}, ExrType::kHalf);
  const ImageF f = ReadExr(folder_ / "f.exr").image;
  const ImageF h = ReadExr(folder_ / "h.exr").image;
  EXPECT_EQ(f.data[0], 1.0000001F);
  EXPECT_EQ(f.data[1], 1e20F);
  EXPECT_TRUE(std::isnan(f.data[2]));
  EXPECT_EQ(h.data[0], 1.0F);
  EXPECT_EQ(h.data[1], 65504.0F);
  EXPECT_TRUE(std::isnan(h.data[2]));
}

TEST_F(ImageIo, ExrBytesAreTheSameTwice) {
  const ImageF image = Pattern(64, 64, 3);
  WriteExr(folder_ / "a.exr", image);
  WriteExr(folder_ / "b.exr", image);
  EXPECT_EQ(ReadFile(folder_ / "a.exr"), ReadFile(folder_ / "b.exr"));
}

TEST_F(ImageIo, ExrGreyIsRepeated) {
  const ImageF image = Pattern(9, 4, 1);
  WriteExr(folder_ / "depth.exr", image, {"V"});
  const StoredPicture picture = ReadPicture(folder_ / "depth.exr", Rect{2, 1, 4, 2});
  EXPECT_EQ(picture.width, 9);
  EXPECT_EQ(picture.window, (Rect{2, 1, 4, 2}));
  for (int c = 0; c < 3; ++c) EXPECT_EQ(picture.image.At(1, 1, c), image.At(3, 2));
}

TEST_F(ImageIo, ExrTilesAndDataWindow) {
  // A tiled file whose data window lies inside the display window, of both pixel types.
  const ImageF image = Pattern(50, 40, 2);
  const Imath::Box2i display({0, 0}, {59, 49});
  const Imath::Box2i data({5, 3}, {54, 42});
  Imf::Header header(display, data);
  header.channels().insert("R", Imf::FLOAT);
  header.channels().insert("G", Imf::FLOAT);
  header.setTileDescription(Imf::TileDescription(16, 8, Imf::ONE_LEVEL));
  {
    Imf::TiledOutputFile out((folder_ / "t.exr").c_str(), header, 0);
    Imf::FrameBuffer buffer;
    auto* base = const_cast<float*>(image.data.data());
    buffer.insert("R", Imf::Slice::Make(Imf::FLOAT, base, data, 8, 8 * 50));
    buffer.insert("G", Imf::Slice::Make(Imf::FLOAT, base + 1, data, 8, 8 * 50));
    out.setFrameBuffer(buffer);
    out.writeTiles(0, out.numXTiles() - 1, 0, out.numYTiles() - 1);
  }
  ImageF whole(60, 50, 2);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 50; ++x) {
      for (int c = 0; c < 2; ++c) whole.At(x + 5, y + 3, c) = image.At(x, y, c);
    }
  }
  const std::vector<std::string> names = {"R", "G"};
  ExpectWindow(ReadExr(folder_ / "t.exr", names).image, whole, {0, 0, 60, 50});
  for (const Rect window : {Rect{22, 20, 9, 5}, Rect{0, 0, 4, 50}, Rect{50, 38, 10, 12}}) {
    ExpectWindow(ReadExr(folder_ / "t.exr", names, window).image, whole, window);
  }
}

TEST_F(ImageIo, DamagedFilesAreNamedAndMendable) {
  WriteExr(folder_ / "a.exr", Pattern(64, 64, 3));
  Truncate(folder_ / "a.exr", 0.5);
  std::string message = MessageOf([&] { (void)ReadExr(folder_ / "a.exr"); });
  EXPECT_THAT(message, HasSubstr("a.exr"));
  EXPECT_THAT(message, HasSubstr("damaged or incomplete"));
  EXPECT_THAT(message, HasSubstr("Copy the file again"));
  WriteFile(folder_ / "b.exr", "no picture");
  EXPECT_THAT(MessageOf([&] { (void)ReadPicture(folder_ / "b.exr"); }), HasSubstr("b.exr"));
  WriteExr(folder_ / "c.exr", Pattern(8, 8, 2), {"a", "b"});
  EXPECT_THAT(MessageOf([&] { (void)ReadExrRgb(folder_ / "c.exr"); }), HasSubstr("a, b"));
  EXPECT_THAT(MessageOf([&] { (void)ReadExr(folder_ / "c.exr", {"z"}); }),
              HasSubstr("no channel z"));
  for (const char* name : {"n.exr", "n.png", "n.tif", "n.hdr", "n.bmp"}) {
    const std::string missing = MessageOf([&] { (void)ReadPicture(folder_ / name); });
    EXPECT_THAT(missing, HasSubstr(name));
  }
  WritePng(folder_ / "a.png", ImageU8(64, 64, 3, 7));
  Truncate(folder_ / "a.png", 0.5);
  EXPECT_THAT(MessageOf([&] { (void)ReadPng(folder_ / "a.png"); }), HasSubstr("ends too early"));
  WriteFile(folder_ / "b.png", "");
  EXPECT_THAT(MessageOf([&] { (void)ReadPng(folder_ / "b.png"); }), HasSubstr("b.png"));
}

TEST_F(ImageIo, PngInMemoryIsTheFilesBytesAndRefusesLargePictures) {
  ImageU16 image(5, 7, 2);
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    image.data[i] = static_cast<std::uint16_t>(977 * i);
  }
  WritePng(folder_ / "m.png", image);
  const std::string bytes = EncodePng(image);
  EXPECT_EQ(bytes, ReadFile(folder_ / "m.png"));
  const PngImage back = DecodePng(bytes, "m", 7);
  EXPECT_EQ(back.bits, 16);
  EXPECT_EQ(back.image.data, image.data);
  EXPECT_THROW((void)DecodePng(bytes, "m", 6), Error);
  EXPECT_THROW((void)DecodePng(bytes.substr(0, 60), "m"), Error);
}

TEST_F(ImageIo, PngRoundTrip) {
  for (int channels = 1; channels <= 4; ++channels) {
    ImageU8 eight(13, 7, channels);
    ImageU16 sixteen(13, 7, channels);
    for (std::size_t i = 0; i < eight.data.size(); ++i) {
      eight.data[i] = static_cast<std::uint8_t>(i * 7);
      sixteen.data[i] = static_cast<std::uint16_t>(i * 181 + 3);
    }
    WritePng(folder_ / "8.png", eight);
    WritePng(folder_ / "16.png", sixteen);
    const PngImage a = ReadPng(folder_ / "8.png");
    const PngImage b = ReadPng(folder_ / "16.png");
    EXPECT_EQ(a.bits, 8);
    EXPECT_EQ(b.bits, 16);
    EXPECT_TRUE(std::equal(eight.data.begin(), eight.data.end(), a.image.data.begin()));
    EXPECT_EQ(b.image.data, sixteen.data);
    const StoredPicture picture = ReadPicture(folder_ / "16.png", Rect{4, 2, 3, 3});
    EXPECT_EQ(picture.white_level, 65535);
    EXPECT_FALSE(picture.is_float);
    EXPECT_EQ(picture.image.At(1, 1, 2),
              static_cast<float>(sixteen.At(5, 3, channels >= 3 ? 2 : 0)));
    const ImageU8 mask = ReadPngMask(folder_ / "8.png");
    EXPECT_EQ(mask.channels, 1);
    EXPECT_EQ(mask.At(6, 5), eight.At(6, 5, 0));
  }
}

// Writes `image` as TIFF of `bits`, as strips or tiles, interleaved or plane by plane.
void WriteTiff(const std::filesystem::path& path,
               const ImageF& image,
               int bits,
               bool is_float,
               bool planes,
               bool tiles,
               int strip = 1) {
  TIFF* tiff = TIFFOpen(path.c_str(), "w");
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, image.width);
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, image.height);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, image.channels);
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, bits);
  TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, is_float ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, planes ? PLANARCONFIG_SEPARATE : PLANARCONFIG_CONTIG);
  TIFFSetField(
      tiff, TIFFTAG_PHOTOMETRIC, image.channels == 1 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB);
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_LZW);
  const int block_width = tiles ? 16 : image.width;
  const int block_height = tiles ? 16 : 1;
  if (tiles) {
    TIFFSetField(tiff, TIFFTAG_TILEWIDTH, block_width);
    TIFFSetField(tiff, TIFFTAG_TILELENGTH, block_height);
  } else {
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, strip);
  }
  const int step = planes ? 1 : image.channels;
  for (int plane = 0; plane < (planes ? image.channels : 1); ++plane) {
    for (int y0 = 0; y0 < image.height; y0 += block_height) {
      for (int x0 = 0; x0 < image.width; x0 += block_width) {
        std::string block;
        for (int y = y0; y < y0 + block_height; ++y) {
          for (int x = x0; x < x0 + block_width; ++x) {
            for (int c = 0; c < step; ++c) {
              const float value =
                  image.At(std::min(x, image.width - 1), std::min(y, image.height - 1), plane + c);
              const auto integer = static_cast<std::uint16_t>(value);
              if (bits == 8) block.push_back(static_cast<char>(integer));
              if (bits == 16) block.append(reinterpret_cast<const char*>(&integer), 2);
              if (bits == 32) block.append(reinterpret_cast<const char*>(&value), 4);
            }
          }
        }
        if (tiles) {
          TIFFWriteTile(tiff,
                        block.data(),
                        static_cast<std::uint32_t>(x0),
                        static_cast<std::uint32_t>(y0),
                        0,
                        static_cast<std::uint16_t>(plane));
        } else {
          TIFFWriteScanline(tiff,
                            block.data(),
                            static_cast<std::uint32_t>(y0),
                            static_cast<std::uint16_t>(plane));
        }
      }
    }
  }
  TIFFClose(tiff);
}

TEST_F(ImageIo, TiffOfEveryLayout) {
  for (const int bits : {8, 16, 32}) {
    for (const int channels : {1, 3}) {
      ImageF image(37, 21, channels);
      for (std::size_t i = 0; i < image.data.size(); ++i) {
        image.data[i] = static_cast<float>(bits == 8 ? i * 11 % 256 : i * 23 % 60000);
        if (bits == 32) image.data[i] += 0.125F;
      }
      for (const bool planes : {false, true}) {
        for (const bool tiles : {false, true}) {
          WriteTiff(folder_ / "a.tif", image, bits, bits == 32, planes, tiles);
          const TiffImage read = ReadTiff(folder_ / "a.tif");
          EXPECT_EQ(read.bits, bits);
          EXPECT_EQ(read.is_float, bits == 32);
          EXPECT_EQ(read.image.data, image.data) << bits << channels << planes << tiles;
          for (const int strip : {1, 4, 21}) {
            WriteTiff(folder_ / "a.tif", image, bits, bits == 32, planes, tiles, strip);
            for (const Rect& window : {Rect{5, 3, 20, 11}, {-4, 17, 90, 90}, {40, 2, 5, 5}}) {
              const StoredPicture part = ReadPicture(folder_ / "a.tif", window);
              EXPECT_EQ(part.width, 37);
              EXPECT_EQ(part.window, Intersect(window, {0, 0, 37, 21}));
              for (int y = 0; y < part.image.height; ++y) {
                for (int x = 0; x < part.image.width; ++x) {
                  ASSERT_EQ(part.image.At(x, y, 2),
                            image.At(x + part.window.x, y + part.window.y, channels - 1));
                }
              }
            }
          }
        }
      }
    }
  }
  Truncate(folder_ / "a.tif", 0.4);
  EXPECT_THAT(MessageOf([&] { (void)ReadTiff(folder_ / "a.tif"); }), HasSubstr("a.tif"));
}

// What lies outside the window is not decoded: damage there does no harm.
TEST_F(ImageIo, TiffDecodesTheWindowOnly) {
  ImageF image(64, 64, 3);
  for (std::size_t i = 0; i < image.data.size(); ++i) image.data[i] = static_cast<float>(i % 251);
  for (const bool tiles : {false, true}) {
    WriteTiff(folder_ / "a.tif", image, 16, false, false, tiles, 8);
    std::string bytes = ReadFile(folder_ / "a.tif");
    std::fill_n(bytes.begin() + 8, 64, '\xff');  // in the first strip or tile
    WriteFile(folder_ / "a.tif", bytes);
    EXPECT_THAT(MessageOf([&] { (void)ReadPicture(folder_ / "a.tif"); }), HasSubstr("damaged"));
    const StoredPicture part = ReadPicture(folder_ / "a.tif", Rect{20, 18, 30, 40});
    EXPECT_EQ(part.image.data, Crop(image, {20, 18, 30, 40}).data);
  }
}

TEST_F(ImageIo, RgbeFlatAndPacked) {
  // 8 pixels of (0.5, 1, 2) = mantissas (32, 64, 128), exponent 130: packed and flat, and old runs.
  const std::string header = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 8\n";
  const std::string packed_line(
      "\x02\x02\x00\x08\x88\x20\x88\x40\x04\x80\x80\x80\x80\x84\x80\x88\x82", 17);
  const std::string pixel("\x20\x40\x80\x82", 4);
  std::string flat_line;
  for (int i = 0; i < 8; ++i) flat_line += pixel;
  const std::string run_line = pixel + std::string("\x01\x01\x01\x07", 4);
  for (const std::string& second : {flat_line, run_line}) {
    WriteFile(folder_ / "a.hdr", header + packed_line + second);
    const ImageF image = ReadRgbe(folder_ / "a.hdr");
    ASSERT_EQ(image.width, 8);
    ASSERT_EQ(image.height, 2);
    for (int y = 0; y < 2; ++y) {
      for (int x = 0; x < 8; ++x) {
        EXPECT_EQ(image.At(x, y, 0), 0.5F);
        EXPECT_EQ(image.At(x, y, 1), 1.0F);
        EXPECT_EQ(image.At(x, y, 2), 2.0F);
      }
    }
  }
  WriteFile(folder_ / "a.hdr", header + packed_line);
  EXPECT_THAT(MessageOf([&] { (void)ReadRgbe(folder_ / "a.hdr"); }), HasSubstr("ends too early"));
  WriteFile(folder_ / "a.hdr", "#?RADIANCE\n\n-Y 999999 +X 999999\n");
  EXPECT_THAT(MessageOf([&] { (void)ReadRgbe(folder_ / "a.hdr"); }), HasSubstr("impossible"));
}

}  // namespace
}  // namespace dyxel
