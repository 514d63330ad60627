// Everything that is wrong with a capture, at once, and what is in it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "dyxel/base/progress.h"
#include "dyxel/capture/manifest.h"

namespace dyxel {

// A sequence as it lies on the disk.
struct SequenceCheck {
  std::string name;
  std::string kind;
  int frames = 0;           // that the manifest promises
  int pictures = 0;         // read without a fault, all cameras
  int missing = 0;          // that are not there
  std::string lighting;     // "spot0, spot1", "changing", "env/lobby.exr" or "none"
  std::string silhouette;   // "masks", "plate", "8 plates" or "none"
  double exposure = 0;      // median over the pictures of each one's 99.5th percentile, radiance
  double exposure_max = 0;  // the brightest picture's
  double saturated = 0;     // share of pixels with a clipped channel
};

struct CheckReport {
  std::filesystem::path folder;
  Capture capture;               // what could be read of the manifest
  std::vector<CheckItem> items;  // errors first, then by file
  std::vector<SequenceCheck> sequences;
  Vec3d centre = Vec3d::Zero();  // where the cameras' axes meet best; NaN with fewer than two

  [[nodiscard]] int Count(Severity severity) const;
};

// Reads the manifest and every picture, plate, mask and environment of a capture. Never throws for
// what the capture holds: each fault is an item.
[[nodiscard]] CheckReport CheckCapture(const std::filesystem::path& folder,
                                       const ProgressFn& progress = {});

// Tables of cameras, lights and sequences, then what is wrong and how to mend it.
[[nodiscard]] std::string FormatCheckReport(const CheckReport& report);
// The same as a JSON object: capture, cameras, lights, sequences, items.
[[nodiscard]] std::string CheckReportJson(const CheckReport& report);

namespace internal {

// The point nearest to all cameras' axes (least squares), and whether there is one.
[[nodiscard]] bool MeetingPoint(const std::vector<Camera>& cameras, Vec3d& point);

// Which frames [0, count) have a file of that pattern, and how many files lie outside. Lists the
// folder: its cost does not grow with `count` but for the result.
struct FrameFiles {
  std::vector<int> present;  // ascending frame indices
  int before = 0;            // files numbered below `first`
  int after = 0;             // files numbered from first + count on
};
[[nodiscard]] FrameFiles ListFrames(const std::filesystem::path& folder,
                                    const std::string& pattern,
                                    const std::string& camera,
                                    int first,
                                    int count);

// "3, 7-9" of ascending numbers; and of the numbers first + i, i in [0, count), whose i is not in
// the ascending `present`. After eight parts comes "…".
[[nodiscard]] std::string Ranges(const std::vector<int>& numbers);
[[nodiscard]] std::string Gaps(const std::vector<int>& present, int first, int count);

}  // namespace internal
}  // namespace dyxel
