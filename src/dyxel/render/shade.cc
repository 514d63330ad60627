#include "dyxel/render/shade.h"

#include <algorithm>
#include <cmath>

#include "dyxel/base/error.h"
#include "dyxel/base/lanes.h"
#include "dyxel/reflectance/brdf.h"

namespace dyxel::internal {
namespace {

template <Real T>
T Load(const ShadeBlock::Row& row, int i) {
  if constexpr (std::floating_point<T>) {
    return row[static_cast<std::size_t>(i)];
  } else {
    return T::load_aligned(row.data() + i);
  }
}

template <Real T>
void Store(const T& x, ShadeBlock::Row& row, int i) {
  if constexpr (std::floating_point<T>) {
    row[static_cast<std::size_t>(i)] = x;
  } else {
    x.store_aligned(row.data() + i);
  }
}

template <Real T>
std::array<T, 3> Load3(const std::array<ShadeBlock::Row, 3>& rows, int i) {
  return {Load<T>(rows[0], i), Load<T>(rows[1], i), Load<T>(rows[2], i)};
}

template <Real T>
T Dot(const std::array<T, 3>& a, const std::array<T, 3>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// What one light gives to the points of a block: the unit direction towards it, and distance and
// cone falloff times max(0, n·l), zero on the far side.
struct Incidence {
  alignas(64) std::array<ShadeBlock::Row, 3> to_light;
  alignas(64) ShadeBlock::Row cos_light;
  alignas(64) ShadeBlock::Row weight;
};

template <Real T>
void ComputeIncidence(const ShadeLight& light, const ShadeBlock& block, Incidence& out) {
  const T zero(0);
  const T one(1);
  for (int i = 0; i < block.count; i += kLaneCount<T>) {
    std::array<T, 3> l;
    T falloff = one;
    if (light.directional) {
      l = {T(light.direction[0]), T(light.direction[1]), T(light.direction[2])};
    } else {
      const std::array<T, 3> x = Load3<T>(block.position, i);
      for (std::size_t a = 0; a < 3; ++a) l[a] = T(light.position[a]) - x[a];
      const T squared = Dot(l, l);
      falloff = one / Select(squared < T(1e-12F), T(1e-12F), squared);
      const T inverse = Sqrt(falloff);
      for (std::size_t a = 0; a < 3; ++a) l[a] *= inverse;
      const T cos_axis = -(l[0] * T(light.direction[0]) + l[1] * T(light.direction[1]) +
                           l[2] * T(light.direction[2]));
      const T s = Clamp((cos_axis - T(light.cos_outer)) * T(light.inverse_cone), zero, one);
      falloff *= s * s * (T(3) - T(2) * s);
    }
    const T n_l = Dot(l, Load3<T>(block.normal, i));
    const T side = Dot(l, Load3<T>(block.side, i));
    for (std::size_t a = 0; a < 3; ++a) Store(l[a], out.to_light[a], i);
    Store(n_l, out.cos_light, i);
    Store(Select((zero < n_l) & (zero < side), falloff * n_l, zero), out.weight, i);
  }
}

// weight *= visibility; false where nothing of the block is lit.
bool ApplyShadow(const ShadowMap* shadow, const ShadeBlock& block, ShadeBlock::Row& weight) {
  bool lit = false;
  for (std::size_t i = 0; i < static_cast<std::size_t>(block.count); ++i) {
    if (weight[i] <= 0) continue;
    if (shadow != nullptr) {
      weight[i] *=
          shadow->Visible(Vec3f(block.position[0][i], block.position[1][i], block.position[2][i]),
                          Vec3f(block.side[0][i], block.side[1][i], block.side[2][i]));
    }
    lit = lit || weight[i] > 0;
  }
  return lit;
}

template <class Brdf, Real T>
void AddLight(const ShadeLight& light, const Incidence& incidence, ShadeBlock& block) {
  for (int i = 0; i < block.count; i += kLaneCount<T>) {
    const T weight = Load<T>(incidence.weight, i);
    if (!Any(T(0) < weight)) continue;
    typename Brdf::template Params<T> specular;
    for (std::size_t p = 0; p < specular.size(); ++p) specular[p] = Load<T>(block.specular[p], i);
    const std::array<T, 3> v = Load3<T>(block.view, i);
    const Cosines<T> cosines = SeenCosines<T>(Load<T>(incidence.cos_light, i),
                                              Dot(v, Load3<T>(block.normal, i)),
                                              Dot(v, Load3<T>(incidence.to_light, i)));
    const T shape = Brdf::template DiffuseShape<T>(specular, cosines);
    const T gloss = Brdf::template Specular<T>(specular, cosines);
    for (std::size_t c = 0; c < 3; ++c) {
      const T f = Load<T>(block.diffuse[c], i) * shape + gloss;
      const T sum = Load<T>(block.radiance[c], i) + weight * T(light.power[c]) * f;
      Store(sum, block.radiance[c], i);
    }
  }
}

}  // namespace

ShadeLight MakeShadeLight(const Light& light) {
  ShadeLight out;
  out.directional = light.type == LightType::kDirectional;
  const Vec3f axis = light.direction.normalized().cast<float>();
  for (std::size_t a = 0; a < 3; ++a) {
    const auto e = static_cast<Eigen::Index>(a);
    out.position[a] = static_cast<float>(light.position[e]);
    out.direction[a] = out.directional ? -axis[e] : axis[e];
    out.power[a] = out.directional ? light.irradiance[e] : light.intensity[e];
  }
  if (light.type == LightType::kSpot) {
    const double inner = std::cos(light.cone_inner);
    const double outer = std::cos(light.cone_outer);
    out.cos_outer = static_cast<float>(outer);
    out.inverse_cone = static_cast<float>(1 / std::max(1e-6, inner - outer));
  }
  return out;
}

template <class T>
void Shade(std::string_view model,
           std::span<const ShadeLight> lights,
           std::span<const ShadowMap> shadows,
           ShadeBlock& block) {
  for (ShadeBlock::Row& row : block.radiance) row.fill(0);
  VisitBrdf(model, [&](auto brdf) {
    using Brdf = decltype(brdf);
    static_assert(Brdf::kNumSpecular <= kMaxSpecular);
    Incidence incidence;
    for (std::size_t j = 0; j < lights.size(); ++j) {
      ComputeIncidence<T>(lights[j], block, incidence);
      // Lanes past the last point hold no point.
      for (auto i = static_cast<std::size_t>(block.count); i < incidence.weight.size(); ++i) {
        incidence.weight[i] = 0;
      }
      const ShadowMap* shadow = shadows.empty() ? nullptr : &shadows[j];
      if (ApplyShadow(shadow, block, incidence.weight)) {
        AddLight<Brdf, T>(lights[j], incidence, block);
      }
    }
  });
}

template void Shade<float>(std::string_view,
                           std::span<const ShadeLight>,
                           std::span<const ShadowMap>,
                           ShadeBlock&);
template void Shade<Lanes>(std::string_view,
                           std::span<const ShadeLight>,
                           std::span<const ShadowMap>,
                           ShadeBlock&);

}  // namespace dyxel::internal
