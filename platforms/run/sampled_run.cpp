#include "run/sampled_run.h"

#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "run/expected_error.h"
#include "run/frame_sampler.h"
#include "run/pipeline_run.h"
#include "run/result_hash.h"

#include <vrpipe/component/error.h>

namespace vrpipe {

namespace {

/// What runs took of which nothing is reported.
class HostTime {
 public:
  HostTime& operator+=(const RunResult& result) {
    host_seconds_ += result.host_seconds;
    cpu_seconds_ += result.cpu_seconds;
    return *this;
  }
  void add_to(RunResult& result) const {
    result.host_seconds += host_seconds_;
    result.cpu_seconds += cpu_seconds_;
  }

 private:
  double host_seconds_ = 0, cpu_seconds_ = 0;
};

/// All at `cycle`.
RunResult simulate_whole(RunRequest request, const Frame& frame, std::atomic<float>* progress) {
  request.fidelity = Fidelity::cycle;
  request.units_at_cycle.clear();
  request.sampling.reset();
  return simulate_pipeline(request, frame, progress);
}

/// By windows that warm up for longer where queues go on to fill in them.
///
/// @param request  that can be sampled, as the frame can
/// `in_vain` gets what it took if nothing came of it, and `why_not` the reason.
std::optional<RunResult> simulate_windows(const RunRequest& request, const Frame& frame, std::atomic<float>* progress,
                                          HostTime& in_vain, std::string& why_not) {
  RunRequest functional = request;
  functional.fidelity = Fidelity::functional;
  functional.sampling.reset();
  functional.effects.with.emplace_back("l2.contents");
  why_not.clear();
  std::vector<double> course = estimated_course(frame);
  bool is_estimated = true;
  for (unsigned warm_up_times = 1;;) {
    FrameSampler sampler(request, frame, warm_up_times, course);
    if (!sampler.is_worth_while()) {
      why_not +=
          why_not.empty() ? "half of the frame would be in windows" : ", and half of the frame would be in longer ones";
      return std::nullopt;
    }
    RunResult result = simulate_pipeline(functional, frame, progress, &sampler);
    const std::optional<FrameSampler::Result> sampled = sampler.result();
    if (sampled && sampled->is_settled) {
      result.request = request;
      result.sampling = sampled->report;
      result.sampling->seed = request.sampling->seed;
      result.cycles = sampled->cycles;
      result.kernel_events = sampled->kernel_events;
      result.milliseconds = static_cast<double>(sampled->cycles) / (request.platform->frequency_mhz * 1e3);
      result.expected_error_percent = sampled->report.half_interval_percent;
      result.result_hash = hash_of(result);
      return result;
    }
    in_vain += result;
    if (!sampled) {
      why_not = "the frame ended before its windows";
      if (!is_estimated) return std::nullopt;
      course = sampler.course();  // of less than was estimated, as where much lies behind something
      is_estimated = false;
      continue;
    }
    why_not = fmt::format("queues went on to fill in windows, for {:.0f} % of their time and {:.0f} % of their quads",
                          sampled->report.delay_growth_percent, sampled->report.lead_growth_percent);
    if (!sampled->front_end_is_settled) return std::nullopt;
    warm_up_times *= 4;
  }
}

}  // namespace

RunResult simulate_sampled(const RunRequest& request, const Frame& frame, std::atomic<float>* progress) {
  check_sampling_has_time(request);
  check_may_sample(request);
  HostTime in_vain;
  std::string why_not;
  if (auto result = simulate_windows(request, frame, progress, in_vain, why_not)) {
    in_vain.add_to(*result);
    return std::move(*result);
  }
  RunResult result = simulate_whole(request, frame, progress);
  in_vain.add_to(result);
  result.request = request;
  result.sampling.emplace();
  result.sampling->seed = request.sampling->seed;
  result.sampling->whole_because = why_not;
  return result;
}

namespace {

/// The cheapest way to cycles within RunRequest::error_percent. What a way took that did not get there counts as well.
class WayWithin {
 public:
  WayWithin(const RunRequest& request, const Frame& frame, std::atomic<float>* progress)
      : request_(request), frame_(frame), progress_(progress) {}

  RunResult go() {
    choose_windows();
    std::optional<RunResult> result;
    while (!result) {
      const bool windows_are_cheaper = windows_left_ && (!lt_left_ || time_of_windows() < time_of_lt);
      if (!windows_are_cheaper && !lt_left_) break;
      result = windows_are_cheaper ? by_windows() : by_lt();
    }
    if (!result) {
      result = simulate_whole(request_, frame_, progress_);
      took(*result, "all at cycle");
    }
    in_vain_.add_to(*result);
    return std::move(*result);
  }

 private:
  void took(RunResult& result, const std::string& why) {
    because_.push_back(why);
    result.way = WayReport{fidelity_of(result.request), fmt::format("{}", fmt::join(because_, "; "))};
    result.request = as_taken(request_, result.way);
  }
  std::optional<RunResult> by_lt() {
    lt_left_ = false;
    const double least = least_expected_error_percent();
    if (request_.error_percent < least) {
      because_.push_back(fmt::format("lt never says less than {:.1f} %", least));
      return std::nullopt;
    }
    RunRequest lt = request_;
    lt.fidelity = Fidelity::lt;
    lt.units_at_cycle.clear();
    lt.sampling.reset();
    fresh_simulation();
    RunResult result = simulate_pipeline(lt, frame_, progress_);
    fresh_simulation();
    const std::string says = result.expected_error_percent
                                 ? fmt::format("lt says {:.1f} % of itself", *result.expected_error_percent)
                                 : "lt does not know how far it is off";
    if (result.expected_error_percent.value_or(INFINITY) <= request_.error_percent) {
      took(result, says);
      return result;
    }
    because_.push_back(says);
    in_vain_ += result;
    return std::nullopt;
  }

  void choose_windows() {
    sampled_.fidelity = Fidelity::cycle;
    if (!sampled_.sampling) sampled_.sampling.emplace();
    if (FrameSampler::obstacle(sampled_)) {
      because_.emplace_back("it cannot be sampled");
    } else if (const auto windows = FrameSampler::windows_for(sampled_, request_.error_percent)) {
      sampled_.sampling->windows = *windows;
      windows_left_ = 2;
    } else {
      because_.emplace_back("windows are never as near");
    }
  }
  double time_of_windows() const {
    return time_of_functional + FrameSampler(sampled_, frame_, 1, estimated_course(frame_)).share();
  }

  std::optional<RunResult> by_windows() {
    --windows_left_;
    std::uint64_t& windows = sampled_.sampling->windows;
    std::string why_not;
    std::optional<RunResult> result = simulate_windows(sampled_, frame_, progress_, in_vain_, why_not);
    if (!result) {
      because_.push_back(fmt::format("{} windows: {}", windows, why_not));
      windows_left_ = 0;
      return std::nullopt;
    }
    const double half = result->sampling->half_interval_percent;
    const std::string are = fmt::format("{} windows are within {:.1f} %", windows, half);
    if (half <= request_.error_percent) {
      took(*result, are);
      return result;
    }
    because_.push_back(are);
    in_vain_ += *result;
    // Spread differs between frames: what these windows say of it counts.
    windows = FrameSampler::more_windows(sampled_, windows, half, request_.error_percent);
    return std::nullopt;
  }

  const RunRequest& request_;
  const Frame& frame_;
  std::atomic<float>* const progress_;
  // Processor time on whole frames, in shares of that of `cycle`, as measured (docs/accuracy.md).
  static constexpr double time_of_functional = 0.22;  ///< with the tags of caches
  static constexpr double time_of_lt = 0.55;
  RunRequest sampled_ = request_;
  bool lt_left_ = true;
  unsigned windows_left_ = 0;  ///< times that they may be tried
  std::vector<std::string> because_;
  HostTime in_vain_;
};

}  // namespace

RunResult simulate_within(const RunRequest& request, const Frame& frame, std::atomic<float>* progress) {
  return WayWithin(request, frame, progress).go();
}

void check_error(const RunRequest& request) {
  if (request.error_percent == 0) return;
  const auto refuse = [](const std::string& where, const std::string& why, const std::string& remedy) {
    throw UserError("cannot ask for an error", where, why, remedy);
  };
  if (!(request.error_percent > 0 && request.error_percent <= 100))
    refuse("--error", fmt::format("{:g} % is not above 0 and up to 100", request.error_percent), "ask for 1%");
  if (!request.variant.is_of_pipeline())
    refuse("variant " + request.variant.name, "what is drawn outside the pipeline is at one fidelity",
           "use --fidelity");
  if (request.stop_at > 0 || request.observers != nullptr)
    refuse("--until, --html, --heat-maps", "some ways have no course, and several may be tried", "use --fidelity");
}

void check_may_sample(const RunRequest& request) {
  if (const auto obstacle = FrameSampler::obstacle(request)) throw *obstacle;
}

bool takes_windows(const RunRequest& request, const Frame& frame) {
  return request.sampling && !FrameSampler::obstacle(request) &&
         FrameSampler(request, frame, 1, estimated_course(frame)).is_worth_while();
}

}  // namespace vrpipe
