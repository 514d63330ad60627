#include "dyxel/base/parallel.h"

#include <memory>

#include <tbb/global_control.h>
#include <tbb/info.h>

namespace dyxel {
namespace {
std::unique_ptr<tbb::global_control> control;
int limit = 0;
}  // namespace

void SetJobs(int jobs) {
  limit = jobs;
  control.reset();
  if (jobs > 0) {
    control = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                    static_cast<std::size_t>(jobs));
  }
}

int Jobs() { return limit > 0 ? limit : tbb::info::default_concurrency(); }

}  // namespace dyxel
