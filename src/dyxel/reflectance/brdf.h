// The table of BRDFs; docs/method.md (R1). Each is a struct of one file with
//   kName, kNumSpecular, kSpecular         its name and its specular parameters
//   DiffuseShape<T>(Params<T>, Cosines<T>) B/π, and
//   Specular<T>(Params<T>, Cosines<T>)     S, achromatic, so that
//
//   radiance_c = irradiance_c max(0, n·l) (ρ_c · DiffuseShape + Specular)                  (R1)
//
// is linear in the diffuse albedo ρ_c of each channel once the specular parameters are known.
// T is float, double, Lanes or a Dual of these. One more BRDF is one more file and one line of
// BrdfTable; the fit, the renderer and the export find it there.
#pragma once

#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "dyxel/reflectance/brdf_ggx.h"
#include "dyxel/reflectance/brdf_phong.h"
#include "dyxel/reflectance/shading.h"

namespace dyxel {

using BrdfTable = std::tuple<Phong,  //
                             Ggx>;

[[nodiscard]] std::vector<std::string> BrdfNames();

// The specular parameters of a BRDF, in their order. Throws Error(kUsage) where the table has no
// such name.
[[nodiscard]] std::vector<SpecularInfo> SpecularParameters(std::string_view name);
[[nodiscard]] std::vector<std::string> SpecularNames(std::string_view name);

// Throws Error(kUsage) listing the names of the table.
[[noreturn]] void ThrowUnknownBrdf(std::string_view name);

// f(Brdf{}) with the BRDF of that name, once: put the loop inside. Returns what f returns. Throws
// Error(kUsage) where the table has no such name.
template <std::size_t I = 0, class F>
decltype(auto) VisitBrdf(std::string_view name, F&& f) {
  using Brdf = std::tuple_element_t<I, BrdfTable>;
  if (name == Brdf::kName) return f(Brdf{});
  if constexpr (I + 1 < std::tuple_size_v<BrdfTable>) {
    return VisitBrdf<I + 1>(name, std::forward<F>(f));
  } else {
    ThrowUnknownBrdf(name);
  }
}

// f_r of (R1) for one channel, without irradiance and cosine.
template <class Brdf, Real T>
T EvaluateBrdf(const T& diffuse,
               const typename Brdf::template Params<T>& specular,
               const Cosines<T>& cosines) {
  return diffuse * Brdf::template DiffuseShape<T>(specular, cosines) +
         Brdf::template Specular<T>(specular, cosines);
}

}  // namespace dyxel
