// Maps as PNG within a glTF file (docs/asset-format.md): offset + scale · stored / 65535 (or 255).
#pragma once

#include <string>
#include <vector>

#include "dyxel/image/image.h"
#include "dyxel/video/glb.h"

namespace dyxel::internal {

// Adds a map of 1 to 4 channels as 16-bit PNG, each channel from its least to its greatest value.
// Returns {"image", "offset": [...], "scale": [...]}. A value that is no number is stored as the
// least.
[[nodiscard]] Json AddMap16(GlbBuilder& glb, const ImageF& map, const std::string& name);
// A map in [0, 1] of one channel as 8-bit PNG; an integer map as it is.
[[nodiscard]] Json AddMap8(GlbBuilder& glb, const ImageF& map, const std::string& name);
[[nodiscard]] Json AddLabels(GlbBuilder& glb, const ImageU8& map, const std::string& name);

// The PNG bytes of a normal map: x and y in the tangent frame with `bits` (8 to 16) bits each, zero
// exactly representable; z is what is left of the unit length. The third channel is constant.
[[nodiscard]] std::string EncodeNormals(const ImageF& normals, int bits);
// {"image", "offset", "scale"} of one that is already encoded.
[[nodiscard]] Json AddNormals(GlbBuilder& glb,
                              const std::string& png,
                              int bits,
                              const std::string& name);

// The maps again, [size][size][channels]. Throw Error(kInput) with the file where the picture is
// damaged, of another size or of fewer channels.
[[nodiscard]] ImageF ReadMap(const GlbFile& glb, const Json& coded, int size, int channels);
[[nodiscard]] ImageU8 ReadLabels(const GlbFile& glb, const Json& coded, int size, int largest);
[[nodiscard]] ImageF ReadNormals(const GlbFile& glb, const Json& coded, int size);

}  // namespace dyxel::internal
