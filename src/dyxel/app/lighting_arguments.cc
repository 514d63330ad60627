#include "dyxel/app/lighting_arguments.h"

#include <charconv>
#include <filesystem>

#include "dyxel/base/error.h"
#include "dyxel/capture/capture.h"

namespace dyxel {
namespace {

std::vector<std::string> Split(const std::string& text, char separator) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == separator) {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

std::vector<double> Numbers(const std::string& light, const std::string& text, std::size_t count) {
  std::vector<double> numbers;
  for (const std::string& part : Split(text, ',')) {
    double value = 0;
    const auto result = std::from_chars(part.data(), part.data() + part.size(), value);
    Require(result.ec == std::errc() && result.ptr == part.data() + part.size(),
            Fault::kUsage,
            "--light {}: \"{}\" is no number.",
            light,
            part);
    numbers.push_back(value);
  }
  Require(numbers.size() == count,
          Fault::kUsage,
          "--light {}: \"{}\" must be {} numbers with commas between.",
          light,
          text,
          count);
  return numbers;
}

Vec3d Vector(const std::string& light, const std::string& text) {
  const std::vector<double> n = Numbers(light, text, 3);
  return {n[0], n[1], n[2]};
}

Rgb Colour(const std::string& light, const std::string& text) {
  return Vector(light, text).cast<float>().array();
}

Vec3d Direction(const std::string& light, const std::string& text) {
  const Vec3d d = Vector(light, text);
  Require(d.norm() > 0, Fault::kUsage, "--light {}: the direction must not be zero.", light);
  return d.normalized();
}

}  // namespace

Light ParseLight(const std::string& text) {
  const std::vector<std::string> parts = Split(text, ':');
  Light light;
  light.name = text;
  if (parts[0] == "point" && parts.size() == 3) {
    light.type = LightType::kPoint;
    light.position = Vector(text, parts[1]);
    light.intensity = Colour(text, parts[2]);
  } else if (parts[0] == "directional" && parts.size() == 3) {
    light.type = LightType::kDirectional;
    light.direction = Direction(text, parts[1]);
    light.irradiance = Colour(text, parts[2]);
  } else if (parts[0] == "spot" && parts.size() == 5) {
    light.type = LightType::kSpot;
    light.position = Vector(text, parts[1]);
    light.direction = Direction(text, parts[2]);
    light.intensity = Colour(text, parts[3]);
    const std::vector<double> cone = Numbers(text, parts[4], 2);
    Require(0 <= cone[0] && cone[0] < cone[1] && cone[1] < kPiD / 2,
            Fault::kUsage,
            "--light {}: the cone must be 0 <= INNER < OUTER < π/2 radians.",
            text);
    light.cone_inner = cone[0];
    light.cone_outer = cone[1];
  } else {
    throw Error(Fault::kUsage,
                fmt::format("--light {}: must be point:X,Y,Z:R,G,B, directional:DX,DY,DZ:R,G,B or "
                            "spot:X,Y,Z:DX,DY,DZ:R,G,B:INNER,OUTER.",
                            text));
  }
  return light;
}

Environment ParseEnvironment(const std::string& text, const Vec3d& up) {
  std::string file = text;
  double rotation = 0;
  const auto at = text.rfind('@');
  if (at != std::string::npos && !std::filesystem::exists(text)) {
    const char* begin = text.data() + at + 1;
    const char* end = text.data() + text.size();
    const auto result = std::from_chars(begin, end, rotation);
    Require(result.ec == std::errc() && result.ptr == end,
            Fault::kUsage,
            "--env {}: what follows @ must be an angle in radians.",
            text);
    file = text.substr(0, at);
  }
  return LoadEnvironmentFile(file, rotation, up);
}

std::vector<Light> DefaultLights(const Vec3d& up) {
  // Two horizontal axes across `up`.
  const Vec3d x = up.unitOrthogonal();
  const Vec3d y = up.cross(x);
  Light key;
  key.name = "key";
  key.type = LightType::kDirectional;
  key.direction = (-x - 0.6 * y - 0.9 * up).normalized();
  key.irradiance = Rgb(3.0F, 2.85F, 2.6F);
  Light fill = key;
  fill.name = "fill";
  fill.direction = (0.8 * x + y - 0.5 * up).normalized();
  fill.irradiance = Rgb(1.0F, 1.1F, 1.3F);
  return {key, fill};
}

}  // namespace dyxel
