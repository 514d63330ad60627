#include "dyxel/capture/check.h"

#include <algorithm>
#include <atomic>
#include <charconv>
#include <cmath>
#include <map>
#include <mutex>
#include <set>

#include "dyxel/base/error.h"
#include "dyxel/base/parallel.h"
#include "dyxel/capture/picture_check.h"
#include "dyxel/capture/rig_check.h"
#include "dyxel/image/video.h"

namespace dyxel {
namespace {

using internal::FrameFiles;
using internal::ListFrames;
using internal::PictureCheck;
using internal::Ranges;

enum class Use { kFrame, kPlate, kMask };

// A picture to be read; a whole video is one job.
struct Job {
  std::size_t sequence = 0;
  std::size_t camera = 0;
  int frame = 0;
  Use use = Use::kFrame;
  std::string file;  // relative to the capture
  bool video = false;
};

std::string RangesText(const std::vector<std::pair<int, int>>& ranges) {
  constexpr std::size_t kMost = 8;
  std::string text;
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    if (i > 0) text += ", ";
    if (i == kMost) return text + "…";
    const auto& [from, to] = ranges[i];
    text += to > from ? fmt::format("{}-{}", from, to) : std::to_string(from);
  }
  return text;
}

class Checker {
 public:
  Checker(CheckReport& report, const ProgressFn& progress) : report_(report), progress_(progress) {}

  void Run() {
    for (std::size_t s = 0; s < report_.capture.sequences.size(); ++s) CheckSequence(s);
    ReadAll();
    for (std::size_t s = 0; s < report_.capture.sequences.size(); ++s) Summarise(s);
  }

 private:
  void Add(Severity severity, std::string file, std::string what, std::string mend) {
    report_.items.push_back({severity, std::move(file), std::move(what), std::move(mend)});
  }

  // What is there of a sequence, without reading a picture; makes the jobs.
  void CheckSequence(std::size_t s) {
    const Capture& capture = report_.capture;
    const Sequence& sequence = capture.sequences[s];
    constexpr const char* kKinds[] = {"reflectance", "dynamic", "validation"};
    SequenceCheck check;
    check.name = sequence.name;
    check.kind = kKinds[static_cast<int>(sequence.kind)];
    check.frames = sequence.count;
    check.lighting = Lighting(sequence);
    check.silhouette = Silhouette(sequence);
    report_.sequences.push_back(check);
    if (sequence.environment) CheckEnvironment(*sequence.environment);
    if (sequence.count < 1 || sequence.images.empty()) return;  // the manifest's items say so
    for (std::size_t c = 0; c < capture.cameras.size(); ++c) {
      if (capture.cameras[c].name.empty()) continue;
      if (IsVideo(sequence)) {
        AddVideo(s, c);
      } else {
        AddFrames(s, c);
      }
      AddPlates(s, c);
    }
  }

  std::string Lighting(const Sequence& sequence) {
    const bool reflectance = sequence.kind == SequenceKind::kReflectance;
    if (sequence.environment) {
      if (reflectance) {
        Add(Severity::kWarning,
            "capture.json",
            fmt::format("the sequence \"{}\" is of kind \"reflectance\" and lit by an environment",
                        sequence.name),
            "Reflectance is measured under lamps: name its lights, or call it \"validation\"");
      }
      return sequence.environment->file.generic_string();
    }
    const auto& changing = sequence.frame_lights;
    if (std::any_of(changing.begin(), changing.end(), [](const auto& l) { return !l.empty(); })) {
      return "changing";
    }
    if (changing.empty() && !sequence.lights.empty()) {
      return fmt::format("{}", fmt::join(sequence.lights, ", "));
    }
    Add(Severity::kWarning,
        "capture.json",
        fmt::format("the sequence \"{}\" names neither lights nor an environment", sequence.name),
        reflectance ? "Name its lights: without them no reflectance can be measured"
                    : "Without them it can be tracked, and no more");
    return "none";
  }

  std::string Silhouette(const Sequence& sequence) {
    if (!sequence.masks.empty()) return "masks";
    if (sequence.background_count > 0) return fmt::format("{} plates", sequence.background_count);
    if (!sequence.background.empty()) return "plate";
    Add(Severity::kError,
        "capture.json",
        fmt::format("the sequence \"{}\" has neither background nor masks", sequence.name),
        "Record a plate without the person, or give masks: nothing else tells the silhouette");
    return "none";
  }

  void CheckEnvironment(const EnvironmentRef& environment) {
    const std::string file = environment.file.generic_string();
    if (file.empty() || !environments_.insert(file).second) return;
    try {
      const StoredPicture map = ReadPicture(report_.capture.folder / environment.file);
      if (!map.is_float) {
        Add(Severity::kError,
            file,
            "holds integers, not radiance",
            "Use an EXR or Radiance .hdr file");
        return;
      }
      if (map.width != 2 * map.height) {
        Add(Severity::kWarning,
            file,
            fmt::format("is {}x{} pixels; a latitude-longitude map is twice as wide as high",
                        map.width,
                        map.height),
            "Check that it is a latitude-longitude map of the whole sphere");
      }
      const std::vector<float>& values = map.image.data;
      const auto bad = std::count_if(
          values.begin(), values.end(), [](float value) { return !std::isfinite(value); });
      if (bad > 0) {
        Add(Severity::kError,
            file,
            fmt::format("{:.3g} % of its values are not finite numbers",
                        100.0 * static_cast<double>(bad) / static_cast<double>(values.size())),
            "Find out what wrote NaN or infinity there; no light is 0");
      }
    } catch (const std::exception& error) {
      Add(Severity::kError, file, WithoutFile(error.what(), file), "Put the environment there");
    }
  }

  void AddFrames(std::size_t s, std::size_t c) {
    const Capture& capture = report_.capture;
    const Sequence& sequence = capture.sequences[s];
    const Camera& camera = capture.cameras[c];
    const FrameFiles files =
        ListFrames(capture.folder, sequence.images, camera.name, sequence.first, sequence.count);
    std::vector<int> present = files.present;
    const int missing = sequence.count - static_cast<int>(present.size());
    report_.sequences[s].missing += missing;
    const std::string pattern = PatternOf(sequence.images, camera.name);
    if (present.empty()) {
      Add(Severity::kError,
          pattern,
          fmt::format("not one of the {} frames of sequence \"{}\" is there for camera {}",
                      sequence.count,
                      sequence.name,
                      camera.name),
          "Check the pattern \"images\", first and count in capture.json, or copy the files");
    } else if (missing > 0) {
      if (!sequence.allow_missing) {
        Add(Severity::kError,
            pattern,
            fmt::format("{} of {} frames are missing: {}",
                        missing,
                        sequence.count,
                        internal::Gaps(present, sequence.first, sequence.count)),
            "Copy them, mend first and count, or say \"allow_missing\": true");
      } else if (2 * missing > sequence.count) {
        Add(Severity::kWarning,
            pattern,
            fmt::format("{} of {} frames are missing", missing, sequence.count),
            "Check that the camera really did not see them");
      }
    }
    if (files.before + files.after > 0 && !present.empty()) {
      Add(Severity::kWarning,
          pattern,
          fmt::format("{} more frames are there, outside first = {} and count = {}",
                      files.before + files.after,
                      sequence.first,
                      sequence.count),
          "Mend first and count, if those belong to the sequence");
    }
    for (const int frame : present) {
      const int number = sequence.first + frame;
      jobs_.push_back(
          {s, c, frame, Use::kFrame, ExpandPattern(sequence.images, camera.name, number), false});
    }
    if (sequence.masks.empty()) return;
    const FrameFiles masks =
        ListFrames(capture.folder, sequence.masks, camera.name, sequence.first, sequence.count);
    std::vector<int> without;
    std::set_difference(present.begin(),
                        present.end(),
                        masks.present.begin(),
                        masks.present.end(),
                        std::back_inserter(without));
    if (!without.empty()) {
      for (int& number : without) number += sequence.first;
      Add(Severity::kError,
          PatternOf(sequence.masks, camera.name),
          fmt::format("{} frames have no mask: {}", without.size(), Ranges(without)),
          "Give them, or leave \"masks\" out and give a plate");
    }
    for (const int frame : masks.present) {
      const int number = sequence.first + frame;
      jobs_.push_back(
          {s, c, frame, Use::kMask, ExpandPattern(sequence.masks, camera.name, number), false});
    }
  }

  void AddVideo(std::size_t s, std::size_t c) {
    const Capture& capture = report_.capture;
    const Sequence& sequence = capture.sequences[s];
    const std::string file =
        ExpandPattern(sequence.images, capture.cameras[c].name, sequence.first);
    try {
      const VideoInfo info = ReadVideoInfo(capture.folder / file);
      if (info.frames < sequence.first + sequence.count) {
        Add(Severity::kError,
            file,
            fmt::format("has {} frames; first = {} and count = {} need {}",
                        info.frames,
                        sequence.first,
                        sequence.count,
                        sequence.first + sequence.count),
            "Mend first and count, or copy the whole video");
        return;
      }
      const int more = info.frames - sequence.first - sequence.count;
      if (more > 0) {
        Add(Severity::kWarning,
            file,
            fmt::format("{} more frames are there, after first = {} and count = {}",
                        more,
                        sequence.first,
                        sequence.count),
            "Mend count, if those belong to the sequence");
      }
      jobs_.push_back({s, c, 0, Use::kFrame, file, true});
    } catch (const std::exception& error) {
      report_.sequences[s].missing += sequence.count;
      Add(Severity::kError,
          file,
          WithoutFile(error.what(), file),
          "Check that the file is there and that ffmpeg can play it");
    }
  }

  void AddPlates(std::size_t s, std::size_t c) {
    const Sequence& sequence = report_.capture.sequences[s];
    if (sequence.background.empty()) return;
    for (int i = 0; i < std::max(1, sequence.background_count); ++i) {
      std::string file = ExpandPattern(sequence.background, report_.capture.cameras[c].name, i);
      // Several sequences may share a plate.
      if (plates_.insert(file).second) jobs_.push_back({s, c, i, Use::kPlate, file, false});
    }
  }

  void ReadAll() {
    std::atomic<std::size_t> done{0};
    results_.resize(jobs_.size());
    ParallelFor(jobs_.size(), [&](std::size_t i) {
      results_[i] = Look(jobs_[i]);
      const std::size_t finished = done.fetch_add(1) + 1;
      if (progress_) progress_(static_cast<double>(finished) / static_cast<double>(jobs_.size()));
    });
  }

  // One job's pictures: one, or all frames of a video.
  std::vector<PictureCheck> Look(const Job& job) const {
    const Capture& capture = report_.capture;
    const Camera& camera = capture.cameras[job.camera];
    const Sequence& sequence = capture.sequences[job.sequence];
    const std::filesystem::path path = capture.folder / job.file;
    if (job.use == Use::kMask) return {internal::CheckMask(path, camera)};
    if (!job.video) return {internal::CheckPicture(path, camera, sequence)};
    std::vector<PictureCheck> checks;
    for (int i = 0; i < sequence.count; ++i) {
      try {
        const StoredPicture picture =
            ReadVideoFrame(path, sequence.first + i, [](int width, int height) {
              return Rect{0, 0, width, height};
            });
        checks.push_back(internal::CheckStored(picture, camera, sequence));
      } catch (const std::exception& error) {
        PictureCheck check;
        check.what = WithoutFile(error.what(), job.file);
        check.mend = "Copy the video again";
        checks.push_back(check);
      }
      if (!checks.back().what.empty()) break;  // the rest would say the same
    }
    return checks;
  }

  // Items and figures of one sequence from its results, in the order of the jobs.
  void Summarise(std::size_t s) {
    SequenceCheck& summary = report_.sequences[s];
    std::vector<double> exposures;
    double saturated = 0;
    struct OfCamera {
      int pictures = 0, same = 0, black = 0;
      double saturated = 0;
      std::uint64_t last_hash = 0;
    };
    std::map<std::size_t, OfCamera> cameras;
    for (std::size_t i = 0; i < jobs_.size(); ++i) {
      const Job& job = jobs_[i];
      if (job.sequence != s) continue;
      for (const PictureCheck& check : results_[i]) {
        if (!check.what.empty()) {
          const bool warning = check.read;
          Add(warning ? Severity::kWarning : Severity::kError, job.file, check.what, check.mend);
        }
        if (check.not_finite > 0) {
          Add(Severity::kError,
              job.file,
              fmt::format("{:.3g} % of its pixels are not finite numbers", 100 * check.not_finite),
              "Find out what wrote NaN or infinity there; a mask marks what was not measured");
        }
        if (!check.read || job.use != Use::kFrame) continue;
        ++summary.pictures;
        exposures.push_back(check.exposure);
        saturated += check.saturated;
        OfCamera& camera = cameras[job.camera];
        camera.same += camera.pictures > 0 && check.hash == camera.last_hash ? 1 : 0;
        camera.black += check.exposure <= 0 ? 1 : 0;
        ++camera.pictures;
        camera.saturated += check.saturated;
        camera.last_hash = check.hash;
      }
    }
    if (!exposures.empty()) {
      const auto middle = exposures.begin() + static_cast<std::ptrdiff_t>(exposures.size() / 2);
      std::nth_element(exposures.begin(), middle, exposures.end());
      summary.exposure = *middle;
      summary.exposure_max = *std::max_element(exposures.begin(), exposures.end());
      summary.saturated = saturated / static_cast<double>(exposures.size());
    }
    const Sequence& sequence = report_.capture.sequences[s];
    for (const auto& [index, camera] : cameras) {
      const std::string place = PatternOf(sequence.images, report_.capture.cameras[index].name);
      const double share = camera.saturated / camera.pictures;
      if (share > 0.01) {
        Add(Severity::kWarning,
            place,
            fmt::format("{:.1f} % of the pixels are saturated", 100 * share),
            "Close the iris or dim the lights: what is clipped can't be measured");
      }
      if (camera.same > 0) {
        Add(Severity::kWarning,
            place,
            fmt::format("{} frames are the same as the one before, to the last bit", camera.same),
            "Check the camera's synchronisation and the export");
      }
      if (camera.black > 0) {
        Add(Severity::kWarning,
            place,
            fmt::format("{} frames are black", camera.black),
            "Check the exposure and the lens cap");
      }
    }
  }

  static std::string PatternOf(const std::string& pattern, const std::string& camera) {
    std::string text = pattern;
    const std::size_t at = text.find("{camera}");
    if (at != std::string::npos) text.replace(at, 8, camera);
    return text;
  }

  [[nodiscard]] std::string WithoutFile(std::string text, const std::string& file) const {
    const std::string prefix = (report_.capture.folder / file).string() + ": ";
    if (text.rfind(prefix, 0) == 0) text.erase(0, prefix.size());
    const std::size_t stop = text.rfind(". ");
    return stop == std::string::npos ? text : text.substr(0, stop);
  }

  CheckReport& report_;
  const ProgressFn& progress_;
  std::vector<Job> jobs_;
  std::vector<std::vector<PictureCheck>> results_;  // of each job
  std::set<std::string> plates_;
  std::set<std::string> environments_;
};

}  // namespace

int CheckReport::Count(Severity severity) const {
  return static_cast<int>(std::count_if(items.begin(), items.end(), [&](const CheckItem& item) {
    return item.severity == severity;
  }));
}

CheckReport CheckCapture(const std::filesystem::path& folder, const ProgressFn& progress) {
  Manifest manifest = ReadManifest(folder);
  CheckReport report;
  report.folder = manifest.capture.folder;
  report.capture = std::move(manifest.capture);
  report.items = std::move(manifest.items);
  try {
    internal::CheckRig(manifest.good_cameras, manifest.good_lights, report);
    Checker(report, progress).Run();
  } catch (const std::exception& error) {
    // Such as a folder that can't be listed, or memory that runs out.
    report.items.push_back({Severity::kError,
                            "capture.json",
                            fmt::format("the check could not end ({})", error.what()),
                            "Mend what else is listed, and check again"});
  }
  std::stable_sort(report.items.begin(), report.items.end(), [](const auto& a, const auto& b) {
    return std::tie(a.severity, a.file) < std::tie(b.severity, b.file);
  });
  return report;
}

namespace internal {

FrameFiles ListFrames(const std::filesystem::path& folder,
                      const std::string& pattern,
                      const std::string& camera,
                      int first,
                      int count) {
  FrameFiles files;
  std::error_code error;
  if (!HasFrameField(pattern)) {
    const std::string file = ExpandPattern(pattern, camera, first);
    if (std::filesystem::is_regular_file(folder / file, error)) files.present.push_back(0);
    return files;
  }
  // The path's component with the frame's number: its folder is listed, its names are matched.
  const std::size_t open = pattern.find("{frame");
  const std::size_t slash = pattern.rfind('/', open);
  const std::size_t begin = slash == std::string::npos ? 0 : slash + 1;
  const std::string parent = ExpandPattern(pattern.substr(0, begin), camera, first);
  const std::string prefix = ExpandPattern(pattern.substr(begin, open - begin), camera, first);
  for (std::filesystem::directory_iterator it(folder / parent, error), end; !error && it != end;
       it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (name.rfind(prefix, 0) != 0) continue;
    int number = 0;
    const char* digits = name.data() + prefix.size();
    const auto parsed = std::from_chars(digits, name.data() + name.size(), number);
    if (parsed.ec != std::errc() || number < 0 || parsed.ptr == digits) continue;
    const std::string file = ExpandPattern(pattern, camera, number);
    const std::string found = parent + name;
    const bool same = file == found || (file.rfind(found + "/", 0) == 0);
    if (!same || !std::filesystem::is_regular_file(folder / file, error)) {
      error.clear();
      continue;
    }
    if (number < first) {
      ++files.before;
    } else if (number - first >= count) {
      ++files.after;
    } else {
      files.present.push_back(number - first);
    }
  }
  std::sort(files.present.begin(), files.present.end());
  return files;
}

std::string Ranges(const std::vector<int>& numbers) {
  std::vector<std::pair<int, int>> ranges;
  for (const int number : numbers) {
    if (!ranges.empty() && ranges.back().second + 1 == number) {
      ranges.back().second = number;
    } else {
      ranges.emplace_back(number, number);
    }
  }
  return RangesText(ranges);
}

std::string Gaps(const std::vector<int>& present, int first, int count) {
  std::vector<std::pair<int, int>> ranges;
  int next = 0;
  for (const int frame : present) {
    if (frame > next) ranges.emplace_back(first + next, first + frame - 1);
    next = frame + 1;
  }
  if (next < count) ranges.emplace_back(first + next, first + count - 1);
  return RangesText(ranges);
}

}  // namespace internal
}  // namespace dyxel
