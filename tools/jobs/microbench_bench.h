#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/workloads/microbench.h>

#include "jobs/microbench_job.h"
#include "jobs/processes.h"

/// The microbenchmarks themselves, for microbench_job.cpp: each says what it simulates and what comes of that.

namespace vrpipe::tools {

class MicrobenchBench;
struct PublishedFigure;

struct MicrobenchDefinition {
  const char* name;
  const char* question;
  bool needs_time;
  void (*run)(MicrobenchBench& bench);
  bool is_law = false;  ///< law_names()
};

/// The simulations of a microbenchmark, and what comes of them.
class MicrobenchBench {
 public:
  MicrobenchBench(const MicrobenchDefinition& definition, const RunRequest& request, unsigned processes,
                  MicrobenchResult& result)
      : definition_(definition), request_(request), processes_(processes), result_(result) {
    first_gpc_.gpcs = gpcs_of(request);
    first_gpc_.owns = [map = tile_map_of(request)](TileId tile) { return map(tile) == 0; };
  }

  const RunRequest& request() const { return request_; }
  /// The screen tiles of the platform's first GPC.
  const microbench::GpcTiles& first_gpc() const { return first_gpc_; }
  bool has_time() const { return request_.fidelity != Fidelity::functional; }

  /// A simulation that `run` is to do; returns its number.
  std::size_t add(const RunRequest& request, std::function<microbench::FramePointer()> frame) {
    tasks_.push_back({definition_name(), request, [frame = std::move(frame)](const RunRequest&) { return frame(); }});
    return tasks_.size() - 1;
  }
  std::size_t add(std::function<microbench::FramePointer()> frame) { return add(request_, std::move(frame)); }
  /// All that have been added since the last time.
  void run(bool with_images = false);
  const Simulated& operator[](std::size_t index) const { return done_[index]; }
  double cycles(std::size_t index) const { return static_cast<double>(done_[index].result.cycles.value_or(0)); }

  /// What was measured under a name that published_figures() has.
  void figure(const std::string& name, double measured, const std::string& note = {});
  /// What was measured beside what the real GPU's graphics GPC took.
  void law(const std::string& group, const std::string& label, double measured, double gpu, const char* unit,
           const std::string& source);
  void curve(MicrobenchCurve curve) { result_.curves.push_back(std::move(curve)); }

 private:
  void add_figure(const PublishedFigure& published, const std::string& name, const std::string& group, double measured,
                  const std::string& note);
  std::string definition_name() const { return definition_.name; }

  const MicrobenchDefinition& definition_;
  const RunRequest request_;
  microbench::GpcTiles first_gpc_;
  const unsigned processes_;
  MicrobenchResult& result_;
  ProgressLine progress_;
  std::vector<Task> tasks_;
  std::vector<Simulated> done_;
};

/// Two frames that differ in how much work they have: start-up and the way through the pipeline cancel.
class MicrobenchSlope {
 public:
  /// @param frame  makes one of so many items
  MicrobenchSlope(MicrobenchBench& bench, const RunRequest& request, unsigned items,
                  const std::function<microbench::FramePointer(unsigned items)>& frame)
      : bench_(bench),
        items_(2 * items),
        short_(bench.add(request, [frame, items] { return frame(items); })),
        long_(bench.add(request, [frame, items] { return frame(3 * items); })) {}
  MicrobenchSlope(MicrobenchBench& bench, unsigned items,
                  const std::function<microbench::FramePointer(unsigned items)>& frame)
      : MicrobenchSlope(bench, bench.request(), items, frame) {}

  double clk_per_item() const { return (bench_.cycles(long_) - bench_.cycles(short_)) / items_; }
  double items_per_clk() const { return 1 / clk_per_item(); }
  /// Of a statistic of the longer run.
  double per_item(const std::string& statistic) const {
    return (value(long_, statistic) - value(short_, statistic)) / items_;
  }

 private:
  double value(std::size_t index, const std::string& statistic) const {
    for (const StatisticReport& report : bench_[index].result.statistics) {
      if (report.name == statistic) return static_cast<double>(report.value);
    }
    return 0;
  }
  const MicrobenchBench& bench_;
  const double items_;
  const std::size_t short_;
  const std::size_t long_;
};

// Of what comes before the ROPs (microbench_front_end.cpp):
void measure_tile_binning(MicrobenchBench& bench);
void measure_front_end(MicrobenchBench& bench);
void measure_kill_rate(MicrobenchBench& bench);
// Of CROP (microbench_crop.cpp):
void measure_rop_throughput(MicrobenchBench& bench);
void measure_quad_coverage(MicrobenchBench& bench);
void measure_crop_cache(MicrobenchBench& bench);
void measure_blend_order(MicrobenchBench& bench);
// Of both ROPs (microbench_laws.cpp):
void measure_strips(MicrobenchBench& bench);
void measure_equal_splats(MicrobenchBench& bench);
void measure_same_place(MicrobenchBench& bench);
void measure_returning_lines(MicrobenchBench& bench);

}  // namespace vrpipe::tools
