#include "dyxel/studio/appearance.h"

#include <algorithm>
#include <cmath>

#include "dyxel/studio/noise.h"

namespace dyxel::studio {
namespace {

Rgb Mix(const Rgb& a, const Rgb& b, float t) { return a + t * (b - a); }

// 1 in a band of half-width `half` around multiples of `period`, soft over a millimetre.
float Band(float x, float period, float center, float half) {
  const float t = x - center - period * std::round((x - center) / period);
  return SmoothStep(half + 0.0006F, half - 0.0006F, std::abs(t));
}

// A sun with a face-like ring: distance-based, in the chest's plane (across, up).
float Emblem(float across, float up, float& ring) {
  const float r = std::hypot(across, up);
  const float angle = std::atan2(up, across);
  const float rays = 0.052F + 0.012F * std::cos(9 * angle);
  ring = SmoothStep(0.0015F, 0.0F, std::abs(r - 0.030F) - 0.004F);
  return SmoothStep(0.001F, -0.001F, r - rays);
}

// Coordinates on the garment: along it, and around it as a length.
struct GarmentCoordinates {
  float along, around;
  bool sleeve;
};
GarmentCoordinates ShirtCoordinates(const Vec3f& p) {
  const auto& joints = RestSkeleton();
  const bool left = p.y() > 0;
  const Vec3f shoulder = joints[left ? kLeftUpperArm : kRightUpperArm].position;
  const Vec3f elbow = joints[left ? kLeftForearm : kRightForearm].position;
  const Vec3f along = (elbow - shoulder).normalized();
  const Vec3f q = p - shoulder;
  const float s = q.dot(along);
  const float from_axis = (q - s * along).norm();
  if (s > 0.03F && from_axis < 0.088F && std::abs(p.y()) > 0.168F) {
    const Vec3f side = along.cross(Vec3f::UnitX()).normalized();
    return {s, 0.060F * std::atan2(q.dot(side), q.x()), true};
  }
  // Front and back are panels whose threads run upright; they meet at the side seams.
  const float y = std::clamp(p.y() / 0.260F, -1.0F, 1.0F);
  const float front = 0.260F * std::asin(y);
  return {1.45F - p.z(), p.x() > -0.01F ? front : 0.44F - front, false};
}

Rgb ShirtAlbedo(const Cloth& cloth, const Vec3f& p) {
  const GarmentCoordinates at = ShirtCoordinates(p);
  Rgb c = cloth.base.albedo;
  if (cloth.pattern == Pattern::kStripes) {
    c = Mix(c, cloth.second, Band(at.along, 0.060F, 0.0F, 0.013F));
    c = Mix(c, cloth.third, Band(at.along, 0.060F, 0.030F, 0.0030F));
  } else if (cloth.pattern == Pattern::kPlaid) {
    const float wide_a = Band(at.along, 0.090F, 0.02F, 0.020F);
    const float wide_b = Band(at.around, 0.0942F, 0.02F, 0.020F);
    c = Mix(c, cloth.second, 0.5F * (wide_a + wide_b));
    c = Mix(c, cloth.third, 0.85F * Band(at.along, 0.090F, 0.065F, 0.0030F));
    c = Mix(c, cloth.third, 0.85F * Band(at.around, 0.0942F, 0.065F, 0.0030F));
    c = Mix(c, Rgb(0.75F, 0.74F, 0.68F), 0.8F * Band(at.along, 0.090F, 0.075F, 0.0016F));
    c = Mix(c, Rgb(0.75F, 0.74F, 0.68F), 0.8F * Band(at.around, 0.0942F, 0.075F, 0.0016F));
  }
  if (cloth.print && !at.sleeve) {
    float ring = 0;
    if (p.x() > 0) {
      const float sun = Emblem(p.y() - 0.0F, p.z() - 1.265F, ring);
      c = Mix(c, Rgb(0.78F, 0.46F, 0.06F), sun);
      c = Mix(c, Rgb(0.45F, 0.05F, 0.04F), ring * sun);
    } else {
      // A numeral on the back: a leaning stroke and a bar.
      const float y = -p.y();
      const float z = p.z() - 1.27F;
      const float stroke = std::abs(y - 0.45F * z) - 0.013F;
      const float bar = std::max(std::abs(z - 0.065F) - 0.012F, std::abs(y + 0.005F) - 0.048F);
      const float inside = std::max(std::min(stroke, bar), std::abs(z) - 0.077F);
      c = Mix(c, Rgb(0.78F, 0.74F, 0.64F), SmoothStep(0.001F, -0.001F, inside));
    }
  }
  // Seams: collar, sleeve and hem are a little darker.
  if (at.sleeve && cloth.variation > 0) c *= 1 - 0.25F * Band(at.along, 10.0F, 0.345F, 0.0020F);
  return c;
}

Rgb SkinAlbedo(const Rgb& base, const Vec3f& p) {
  Rgb c = base * (1 + 0.06F * Noise(p * 30) + 0.04F * Noise(p * 90));
  if (p.z() < 1.45F) {  // arms and hands: redder at the knuckles
    return c * Rgb(1.0F, 1 - 0.06F * SmoothStep(0.55F, 0.66F, std::abs(p.y())), 0.97F);
  }
  if (p.x() < 0.02F) return c;
  const float y = std::abs(p.y());
  const auto spot = [&](float cy, float cz, float ry, float rz) {
    const float a = (y - cy) / ry;
    const float b = (p.z() - cz) / rz;
    return a * a + b * b;
  };
  // Cheeks, lips, eyes, brows.
  c = Mix(c, c * Rgb(1.08F, 0.78F, 0.78F), std::exp(-spot(0.042F, 1.600F, 0.018F, 0.016F)));
  const float lips = SmoothStep(1.15F, 0.85F, spot(0.0F, 1.572F, 0.023F, 0.0095F));
  c = Mix(c, Rgb(0.42F, 0.15F, 0.13F), 0.8F * lips);
  const float eye = SmoothStep(1.1F, 0.9F, spot(0.032F, 1.6395F, 0.0135F, 0.0060F));
  c = Mix(c, Rgb(0.72F, 0.70F, 0.66F), eye);
  const float iris = SmoothStep(1.1F, 0.9F, spot(0.032F, 1.6395F, 0.0058F, 0.0058F));
  c = Mix(c, Rgb(0.06F, 0.035F, 0.02F), eye * iris);
  const float lid = SmoothStep(1.3F, 0.8F, spot(0.032F, 1.6470F, 0.0150F, 0.0024F));
  c = Mix(c, Rgb(0.05F, 0.03F, 0.02F), 0.8F * lid);
  const float arch = 1.6610F - 2.6F * (y - 0.034F) * (y - 0.034F) * 4;
  const float brow = SmoothStep(0.0055F, 0.0030F, std::abs(p.z() - arch)) *
                     SmoothStep(0.013F, 0.018F, y) * SmoothStep(0.056F, 0.050F, y);
  return Mix(c, Rgb(0.05F, 0.032F, 0.02F), 0.85F * brow);
}

}  // namespace

Cover OutermostCover(const CoverDistances& covers) {
  return static_cast<Cover>(std::min_element(covers.begin(), covers.end()) - covers.begin());
}

StudioMaterial MaterialAt(const Wardrobe& wardrobe,
                          const Vec3f& pattern_at,
                          const CoverDistances& covers) {
  const Cover cover = OutermostCover(covers);
  const Cloth& cloth = wardrobe[cover];
  const Vec3f& p = pattern_at;
  StudioMaterial m = cloth.base;
  switch (cover) {
    case kShirt:
      m.albedo = ShirtAlbedo(cloth, p);
      break;
    case kSkin:
      m.albedo = cloth.variation > 0 ? SkinAlbedo(m.albedo, p) : m.albedo;
      break;
    case kTrousers: {
      // Side seams and a waistband.
      const float seam = SmoothStep(0.0022F, 0.0012F, std::abs(p.x() + 0.002F)) *
                         SmoothStep(0.11F, 0.12F, std::abs(p.y()));
      if (cloth.variation > 0) m.albedo *= 1 - 0.3F * seam;
      break;
    }
    case kShoes:
      if (p.z() < 0.022F) m.albedo = cloth.second;
      if (p.z() > 0.055F && p.x() > 0.0F && std::abs(std::abs(p.y()) - 0.136F) < 0.018F) {
        m.albedo = Mix(m.albedo, cloth.second, Band(p.x(), 0.020F, 0.0F, 0.0035F));
      }
      break;
    case kHair:
      m.albedo *= 1 + 0.35F * Noise(Vec3f(p.x() * 60, p.y() * 120, p.z() * 40));
      break;
    default:
      break;
  }
  if (cover != kSkin && cloth.variation > 0) {
    m.albedo *= 1 + cloth.variation * (0.6F * Noise(p * 18) + 0.6F * Noise(p * 160));
  }
  m.albedo = m.albedo.max(0.0F).min(1.0F);
  return m;
}

}  // namespace dyxel::studio
