// The manifest, capture.json: read with every mistake in it, and written.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "dyxel/capture/capture.h"

namespace dyxel {

enum class Severity { kError, kWarning };

// One thing that is wrong with a capture.
struct CheckItem {
  Severity severity = Severity::kError;
  std::string file;  // the manifest, or a picture; relative to the capture where it lies in it
  std::string what;  // with the value found
  std::string mend;  // what to do
  friend bool operator==(const CheckItem&, const CheckItem&) = default;
};

struct Manifest {
  Capture capture;  // what could be read; only to be used where no item is an error
  std::vector<CheckItem> items;
  // Of the capture's cameras and lights: whether no item about the entry itself is an error.
  std::vector<bool> good_cameras;
  std::vector<bool> good_lights;
};

// Reads FOLDER/capture.json (FOLDER may also be the manifest itself) and lists all that is wrong in
// it, without looking at any other file. Never throws for what the file holds.
[[nodiscard]] Manifest ReadManifest(const std::filesystem::path& folder);

// Writes `capture` to FOLDER/capture.json, atomically; the pictures are the caller's. `capture`
// must not be scaled. Throws Error(kStage) where it can't be written.
void WriteManifest(const std::filesystem::path& folder, const Capture& capture);

// `pattern` with {camera}, {frame} and {frame:04} filled in.
[[nodiscard]] std::string ExpandPattern(const std::string& pattern,
                                        const std::string& camera,
                                        int frame_number);

// True where the pattern has a {frame}.
[[nodiscard]] bool HasFrameField(const std::string& pattern);

// Frames may be numbered, and lists be long, up to this.
inline constexpr int kMaxCount = 1'000'000;

}  // namespace dyxel
