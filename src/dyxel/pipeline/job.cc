#include "dyxel/base/error.h"
#include "dyxel/pipeline/stages.h"

namespace dyxel {
namespace fs = std::filesystem;

fs::path Job::ReflectanceFolder() const {
  return fit.empty() ? project().folder / "reflectance"
                     : project().folder / "fits" / fit / "reflectance";
}

fs::path Job::NormalFile(const std::string& sequence, int frame) const {
  const fs::path root = fit.empty() ? project().folder : project().folder / "fits" / fit;
  return root / "normals" / sequence /
         (Project::FrameName(project().capture.FindSequence(sequence), frame) + ".exr");
}

Job ProjectJob(Workspace& workspace) {
  Job job;
  job.workspace = &workspace;
  job.reflectance = workspace.project().ReflectanceSequences();
  job.dynamic = workspace.project().DynamicSequences();
  return job;
}

std::vector<Chunk> Chunks(int num_frames, int chunk) {
  std::vector<Chunk> chunks;
  for (int begin = 0; begin < num_frames; begin += chunk) {
    const int end = std::min(begin + chunk, num_frames);
    chunks.push_back({begin, end, (begin + end - 1) / 2});
  }
  return chunks;
}

}  // namespace dyxel
