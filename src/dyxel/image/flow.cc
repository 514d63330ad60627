#include "dyxel/image/flow.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "dyxel/base/error.h"
#include "dyxel/image/sampling.h"

namespace dyxel {
namespace {

constexpr int kSmallestSide = 64;  // DIS's pyramid needs some room

// One thread, once and for all: see the header.
void LimitOpenCv() {
  static std::once_flag once;
  std::call_once(once, [] { cv::setNumThreads(1); });
}

cv::Mat Bytes(const ImageF& image) {
  cv::Mat bytes(image.height, image.width, CV_8U);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const float value = std::clamp(image.At(x, y), 0.0F, 1.0F);
      bytes.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(value * 255 + 0.5F);
    }
  }
  const int right = std::max(0, kSmallestSide - image.width);
  const int bottom = std::max(0, kSmallestSide - image.height);
  if (right + bottom > 0) {
    cv::copyMakeBorder(bytes, bytes, 0, bottom, 0, right, cv::BORDER_REPLICATE);
  }
  return bytes;
}

}  // namespace

ImageF OpticalFlow(const ImageF& from, const ImageF& to) {
  Require(
      from.channels == 1 && to.channels == 1 && from.width == to.width && from.height == to.height,
      Fault::kStage,
      "Optical flow between pictures of {}x{}x{} and {}x{}x{}.",
      from.width,
      from.height,
      from.channels,
      to.width,
      to.height,
      to.channels);
  ImageF flow(from.width, from.height, 2);
  if (flow.empty()) return flow;
  LimitOpenCv();
  cv::Mat field;
  cv::DISOpticalFlow::create(cv::DISOpticalFlow::PRESET_MEDIUM)
      ->calc(Bytes(from), Bytes(to), field);
  for (int y = 0; y < flow.height; ++y) {
    std::copy_n(field.ptr<float>(y), 2 * static_cast<std::size_t>(flow.width), &flow.At(0, y));
  }
  return flow;
}

ImageF Blur(const ImageF& image, float sigma) {
  ImageF result(image.width, image.height, image.channels);
  if (image.empty()) return result;
  LimitOpenCv();
  const int type = CV_MAKETYPE(CV_32F, image.channels);
  // OpenCV's matrices know no const; the source is only read.
  const cv::Mat source(image.height, image.width, type, const_cast<float*>(image.data.data()));
  cv::Mat target(image.height, image.width, type, result.data.data());
  const int size = 2 * static_cast<int>(std::ceil(3 * sigma)) + 1;
  const auto s = static_cast<double>(sigma);
  cv::GaussianBlur(source, target, cv::Size(size, size), s, s, cv::BORDER_REFLECT);
  return result;
}

ImageF NormaliseContrast(const ImageF& image, const ImageU8& mask, float sigma, ImageF* deviation) {
  // Weight, weighted value and square in one image of three channels.
  ImageF moments(image.width, image.height, 3);
  const std::size_t pixels = image.data.size();
  const auto inside = [&](std::size_t i) { return mask.empty() || mask.data[i] >= 128; };
  for (std::size_t i = 0; i < pixels; ++i) {
    if (!inside(i) || !std::isfinite(image.data[i])) continue;
    moments.data[3 * i] = 1;
    moments.data[3 * i + 1] = image.data[i];
    moments.data[3 * i + 2] = image.data[i] * image.data[i];
  }
  const ImageF blurred = Blur(moments, sigma);
  ImageF result(image.width, image.height, 1, 0.5F);
  if (deviation != nullptr) *deviation = ImageF(image.width, image.height, 1);
  for (std::size_t i = 0; i < pixels; ++i) {
    if (moments.data[3 * i] == 0) continue;
    const float weight = blurred.data[3 * i];
    const float mean = blurred.data[3 * i + 1] / weight;
    const float variance = blurred.data[3 * i + 2] / weight - mean * mean;
    const float spread = std::sqrt(std::max(0.0F, variance));
    result.data[i] =
        std::clamp(0.5F + 0.2F * (image.data[i] - mean) / (spread + 0.01F), 0.0F, 1.0F);
    if (deviation != nullptr) deviation->data[i] = spread;
  }
  return result;
}

ImageF WarpByFlow(const ImageF& image, const ImageF& flow, float max_length) {
  ImageF result(image.width, image.height, image.channels);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      float u = flow.At(x, y, 0);
      float v = flow.At(x, y, 1);
      const float length = std::hypot(u, v);
      if (length > max_length) {
        u *= max_length / length;
        v *= max_length / length;
      }
      SampleBilinear(image,
                     static_cast<float>(x) + 0.5F + u,
                     static_cast<float>(y) + 0.5F + v,
                     &result.At(x, y));
    }
  }
  return result;
}

}  // namespace dyxel
