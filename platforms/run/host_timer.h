#pragma once

#include <chrono>
#include <ctime>

#include <vrpipe/platforms/simulation.h>

namespace vrpipe {

/// Takes the time of a simulation on the host. Wall time counts what else the machine does; processor time does not.
class HostTimer {
 public:
  void stop(RunResult& result) const {
    result.host_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_).count();
    result.cpu_seconds = processor_seconds() - processor_;
  }

 private:
  static double processor_seconds() {
    timespec now{};
    ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  }
  std::chrono::steady_clock::time_point wall_ = std::chrono::steady_clock::now();
  double processor_ = processor_seconds();
};

}  // namespace vrpipe
