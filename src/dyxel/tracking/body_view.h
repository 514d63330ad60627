// One time step as the tracker sees it, and the body drawn into its cameras; docs/method.md (T1).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dyxel/capture/camera.h"
#include "dyxel/math/types.h"
#include "dyxel/tracking/distance_field.h"

namespace dyxel::internal {

// A camera for float arithmetic over many points.
class Projector {
 public:
  explicit Projector(const Camera& camera);
  // Pixel position and depth along the axis; a depth <= 0 is behind the camera.
  [[nodiscard]] Vec3f operator()(const Vec3f& x_in_world) const;
  // d(pixel)/d(x_in_world).
  [[nodiscard]] Eigen::Matrix<float, 2, 3> Jacobian(const Vec3f& x_in_world) const;
  // The image direction of a world direction at a point: unit, or zero along the ray.
  [[nodiscard]] Vec2f Direction(const Vec3f& x_in_world, const Vec3f& direction) const;

 private:
  const Camera* camera_;
  bool distorted_;
  Mat3f rotation_;
  Vec3f translation_;
  float fx_, fy_, cx_, cy_;
};

// One camera's silhouette at one time step.
struct View {
  const Camera* camera = nullptr;
  DistanceField field;
  Contour contour;
  float area = 0;  // grid cells inside
  float norm = 0;  // grid cells that the whole person has, about: mismatch is in it
  // Where much of the person is lost in the dark: the field of the person and all that is unknown
  // (kMaskUnknown). Between the two fields nothing is known. Empty where the silhouette is whole.
  DistanceField outer;
  [[nodiscard]] bool partial() const { return !outer.value.empty(); }
  float metres_per_pixel = 0;  // at the person
};

// One time step; cameras without a picture or with an empty mask are left out.
struct Observation {
  std::vector<View> views;
};

// `masks` (one a camera) must not be empty of people in all cameras; `center` and its distance give
// the scale. `partial` (one a camera, or none) says whose unknown pixels say nothing. Grids are
// reduced to at most about `max_cells` cells a side.
[[nodiscard]] Observation Observe(std::span<const Camera> cameras,
                                  std::span<const ImageU8> masks,
                                  const Vec3d& center,
                                  int max_cells = 500,
                                  std::span<const char> partial = {});

// What the outlines need of a mesh's topology.
struct OutlineTopology {
  struct Edge {
    int a, b;  // vertices
    int f, g;  // triangles on its sides
  };
  std::vector<Edge> edges;
};
[[nodiscard]] OutlineTopology MakeOutlineTopology(std::span<const Triangle> triangles,
                                                  int num_vertices);

// A vertex on the drawn outline.
struct Rim {
  int vertex;
  Vec2f pixel;
  Vec2f normal;  // unit, outwards in the picture
  float length;  // pixels of outline that it stands for
};

struct Overlap {
  float both = 0, either = 0;  // grid cells
  float model = 0;             // drawn cells of which something is known
  [[nodiscard]] float Iou() const { return either > 0 ? both / either : 0; }
};

// Draws bodies into one view's grid; keeps its buffers between calls. Not for concurrent use.
class BodyView {
 public:
  // Draws the triangles that face the camera. `subset` (triangle indices) limits them; the buffer
  // keeps what is drawn until Clear().
  void Clear(const View& view);
  void Draw(const View& view,
            std::span<const Vec3f> positions,
            std::span<const Triangle> triangles,
            std::span<const int> subset = {});
  [[nodiscard]] Overlap Compare(const View& view) const;
  // The outline of what Draw() drew last; `normals` are the vertex normals.
  void FindRims(const View& view,
                std::span<const Vec3f> positions,
                std::span<const Vec3f> normals,
                const OutlineTopology& topology,
                std::vector<Rim>& rims);
  // True where the grid cell at a full pixel position is drawn.
  [[nodiscard]] bool Covered(const View& view, const Vec2f& pixel) const;

 private:
  void Prepare(const View& view);

  int width_ = 0, height_ = 0;  // cells of the whole picture
  std::vector<std::uint8_t> drawn_;
  int x0_ = 0, x1_ = -1, y0_ = 0, y1_ = -1;  // box of what is drawn
  std::vector<Vec3f> pixels_;                // (V)
  std::vector<std::int8_t> front_;           // (F)
  std::vector<float> lengths_;               // (V)
};

}  // namespace dyxel::internal
