#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "run/frame_progress.h"
#include "run/sampled_time.h"
#include "run/sampled_window.h"
#include "run/window_plan.h"

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/frame.h>
#include <vrpipe/pipeline/framebuffer.h>
#include <vrpipe/platforms/simulation.h>

namespace vrpipe {

class UntimedGpu;

/// The time of a frame by windows of it that are simulated at `cycle` while the frame is drawn without time: each on the
/// framebuffer, and with the contents of caches, that all before it has left, and with a stretch before it in which the pipeline
/// fills. The first is from the beginning on, the last to the end; the others are at random places, one in each of as many strata,
/// of about equal numbers of quads. One window at a time runs on a thread of its own, beside the frame.
class FrameSampler {
 public:
  /// Why a run cannot be sampled; none if it can.
  static std::optional<UserError> obstacle(const RunRequest& request);
  /// Of which half the interval is, by experience, so many percent; none if it is never as narrow.
  static std::optional<std::uint64_t> windows_for(const RunRequest& request, double error_percent);
  /// After so many were not near enough; at most four times as many.
  static std::uint64_t more_windows(const RunRequest& request, std::uint64_t windows, double half_interval_percent,
                                    double error_percent);

  /// All outlive it.
  /// @param request  at fidelity `cycle`, with a sampling
  /// @param warm_up_times  as long as windows usually warm up
  /// @param course  as estimated_course, or that of another one of the frame
  FrameSampler(const RunRequest& request, const Frame& frame, unsigned warm_up_times,
               const std::vector<double>& course);
  /// Of the frame, about, that is in windows or warms them up.
  double share() const { return plan_.share(); }
  /// Whether that is less than half of it.
  bool is_worth_while() const { return share() < 0.5; }

  /// Before the run of a GPU without time, which outlives this.
  void begin(const UntimedGpu& gpu, const Framebuffer& framebuffer);
  /// A vertex warp has been drawn.
  void passed();
  /// After the run.
  void end();
  struct Result {
    std::uint64_t cycles = 0;
    std::uint64_t kernel_events = 0;  ///< of all windows
    /// Queues do not go on to fill in windows. Where they do, the frame's are fuller than these have been: those behind the
    /// rasteriser are full after some windows of warming up, those before it hold as much as a frame has.
    bool is_settled = false, front_end_is_settled = false;
    SamplingReport report;
  };
  /// Then; none if the frame ended before a window did.
  std::optional<Result> result() const;
  /// Then: quads that were rasterised before each splat, and in all.
  std::vector<double> course() const;

 private:
  /// The course of the frame without time.
  struct Step {
    std::uint64_t splats = 0, primitives = 0, set_up = 0;
    double quads = 0;  ///< rasterised
    SampledWork work{};
  };
  struct Window {
    WindowPlan::Window planned;
    double begin = 0;                  ///< quads rasterised before it warms up
    double from = 0, to = 0;           ///< quads rasterised before it and its end, in the course without time
    std::uint64_t set_up_or_held = 0;  ///< primitives in bins when it begins to warm up
    std::uint64_t primitives_from = 0, primitives_to = 0;  ///< issued before these
    double cycles = 0;
    double delay_growth = 0;  ///< cycles
    double lead_growth = 0;   ///< quads of primitives that were issued and not rasterised yet
  };
  void take_step();
  void begin(Window& window);
  void end_window();
  void find_in_course();
  void find_busiest();
  double quads_at_primitive(std::uint64_t primitive) const;
  double quads_at_setup(std::uint64_t setup) const;
  double quads_at_splat(double splat) const;
  std::vector<std::pair<double, double>> quads_of(const WindowPlan::Window& planned) const;
  SampledWork work_between(double from, double to) const;
  bool is_at_change(const Window& window) const;
  /// Of something from the beginnings of windows to their ends, on average, in shares of something that they have.
  struct Growth {
    double percent, standard_error;
    bool is_within(double most) const { return std::fabs(percent) <= most + 2 * standard_error; }
  };
  /// @param of_window, whole  by window
  template <class OfWindow, class Whole>
  Growth growth(const OfWindow& of_window, const Whole& whole) const;

  RunRequest request_;
  const Frame& frame_;
  const WindowPlan plan_;
  std::vector<Window> windows_;
  std::size_t next_ = 0;  ///< window
  std::size_t draw_ = 0;  ///< that has not ended
  const UntimedGpu* gpu_ = nullptr;
  const Framebuffer* drawn_ = nullptr;
  std::optional<FrameProgress> progress_;
  std::vector<Step> steps_;
  Framebuffer own_;  ///< of windows
  Window* under_way_ = nullptr;
  std::unique_ptr<SampledWindow> run_;  ///< of it; null where none is
  bool is_whole_ = true;                ///< every window was in the frame
  double measured_ = 0, warm_up_ = 0;   ///< cycles
  std::uint64_t kernel_events_ = 0;
};

}  // namespace vrpipe
