#include "dyxel/reflectance/brdf.h"

#include <fmt/ranges.h>

#include "dyxel/base/error.h"

namespace dyxel {

std::vector<std::string> BrdfNames() {
  std::vector<std::string> names;
  const auto add = [&]<class... Brdf>(const std::tuple<Brdf...>*) {
    (names.emplace_back(Brdf::kName), ...);
  };
  add(static_cast<const BrdfTable*>(nullptr));
  return names;
}

std::vector<SpecularInfo> SpecularParameters(std::string_view name) {
  return VisitBrdf(name, []<class Brdf>(Brdf) {
    return std::vector<SpecularInfo>(Brdf::kSpecular.begin(), Brdf::kSpecular.end());
  });
}

std::vector<std::string> SpecularNames(std::string_view name) {
  std::vector<std::string> names;
  for (const SpecularInfo& info : SpecularParameters(name)) names.emplace_back(info.name);
  return names;
}

void ThrowUnknownBrdf(std::string_view name) {
  throw Error(
      Fault::kUsage,
      fmt::format(
          "'{}' is no reflectance model; choose one of: {}", name, fmt::join(BrdfNames(), ", ")));
}

}  // namespace dyxel
