#include "run/frame_sampler.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "elaboration/untimed_gpu.h"

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/platforms/netlist.h>

namespace vrpipe {

namespace {

/// Of the course, in quads.
constexpr double quads_of_step = 2048;
constexpr double measured_quads = 20000;  ///< of a window
constexpr std::uint64_t fewest_windows = 16;

/// What may grow in windows, beyond what chance makes of it. Of the delay 4 % are usual with early termination, and cycles were off,
/// by half of it, where it was 9 or more; of the lead 12 % with QM, and where it mattered it was hundreds.
constexpr double most_delay_percent = 2;
constexpr double most_lead_percent = 25;

/// Of windows, as measured (docs/accuracy.md). Between quads that terminate, queues between RASTER and CROP take long to be as full
/// as they are in the whole frame.
struct WindowFacts {
  double warm_up_quads;
  double bias_percent;    ///< of windows that begin otherwise than the frame goes on, whatever their number
  double spread_percent;  ///< half the interval times the root of the number of windows
  std::uint64_t usual;    ///< windows, where nobody says how many
};
constexpr WindowFacts facts_without_termination{20000, 0.3, 4, 24};
constexpr WindowFacts facts_with_termination{80000, 1.5, 13, 40};
const WindowFacts& facts_of(const RunRequest& request) {
  return request.variant.early_termination ? facts_with_termination : facts_without_termination;
}

/// The share of a range around a centre that is from 0 to `size`.
double share_on_screen(double center, double extent, double size) {
  return std::max(0.0, std::min(center + extent, size) - std::max(center - extent, 0.0)) / std::max(2 * extent, 1e-9);
}

/// Of a splat, about: those in its box and half of those that its edges cross, where they are on the screen.
double estimated_quads(const Splat& splat, const Frame& frame) {
  const double across = std::sqrt(double{splat.ax} * splat.ax + double{splat.ay} * splat.ay);
  const double along = std::sqrt(double{splat.bx} * splat.bx + double{splat.by} * splat.by);
  return (across * along + across + along + 1) *
         share_on_screen(splat.cx, std::fabs(splat.ax) + std::fabs(splat.bx), frame.width()) *
         share_on_screen(splat.cy, std::fabs(splat.ay) + std::fabs(splat.by), frame.height());
}

}  // namespace

std::optional<UserError> FrameSampler::obstacle(const RunRequest& request) {
  const auto refuse = [](const std::string& where, const std::string& why, const std::string& remedy) {
    return UserError("cannot be sampled", where, why, remedy);
  };
  if (!request.variant.is_of_pipeline()) {
    return refuse("variant " + request.variant.name, "windows are of splats on their way through the pipeline",
                  "use lt or cycle");
  }
  if (request.fidelity != Fidelity::cycle) {
    return refuse(std::string("fidelity ") + name_of(request.fidelity), "windows are simulated at cycle", "use cycle");
  }
  if (gpcs_of(request) > 1) {
    return refuse("platform " + request.platform->name,
                  "windows are of one GPC: several do not come as far side by side",
                  "use lt or cycle, or platform.gpcs=1");
  }
  Netlist netlist(1);
  request.platform->wire(netlist);
  if (!netlist.foreign_memories().empty()) {
    return refuse("platform " + request.platform->name,
                  "a memory of another make would be empty at the beginning of each window", "use lt or cycle");
  }
  if (request.sampling && request.sampling->windows != 0 && request.sampling->windows < fewest_windows) {
    return refuse(fmt::format("{} windows", request.sampling->windows), "they say too little of what is between them",
                  fmt::format("take {} at least", fewest_windows));
  }
  if (request.stop_at > 0) return refuse("--until", "no cycle is known by its number", "use cycle");
  return std::nullopt;
}

std::optional<UserError> FrameSampler::obstacle(const Frame& frame) {
  const auto refuse = [](const std::string& why) {
    return UserError("cannot be sampled", "the frame", why, "use lt or cycle");
  };
  if (frame.commands().size() > 1) return refuse("it has several draws or clears, and windows are of one");
  if (frame.draws().empty()) return std::nullopt;
  const DrawCall& call = frame.draws().front();
  if (!call.geometry->triangles.empty() || !call.geometry->mesh.empty())
    return refuse("it has triangles, and windows are of splats");
  if (frame.stencil_preset() != nullptr) return refuse("its stencil is preset, and windows know it cleared or drawn");
  return std::nullopt;
}

std::optional<std::uint64_t> FrameSampler::windows_for(const RunRequest& request, double error_percent) {
  const WindowFacts& facts = facts_of(request);
  if (error_percent <= facts.bias_percent) return std::nullopt;
  const double root = facts.spread_percent / (error_percent - facts.bias_percent);
  // Half as many more, since another pass over the frame takes longer than these. More than there are in any frame are as good as
  // all of them.
  return std::max(fewest_windows, static_cast<std::uint64_t>(std::min(std::ceil(1.5 * root * root), 1e6)));
}

std::uint64_t FrameSampler::more_windows(const RunRequest& request, std::uint64_t windows, double half_interval_percent,
                                         double error_percent) {
  const double bias = facts_of(request).bias_percent;
  // A fifth more, since what they say of their spread is spread as well.
  const double times_as_wide = (half_interval_percent - bias) / (error_percent - bias);
  const double times = 1.2 * times_as_wide * times_as_wide;
  return static_cast<std::uint64_t>(std::ceil(static_cast<double>(windows) * std::clamp(times, 1.0, 4.0)));
}

FrameSampler::FrameSampler(const RunRequest& request, const Frame& frame, unsigned warm_up_times)
    : request_(request), frame_(frame), warm_up_quads_(facts_of(request).warm_up_quads * warm_up_times) {
  request_.sampling.reset();
  request_.observers = nullptr;
  request_.reads_statistics = false;
  std::vector<double> before{0};  // quads, by splat
  for (std::uint32_t i = 0; i < frame.splats(); ++i)
    before.push_back(before.back() + estimated_quads(frame.draws().front().splat(i), frame));
  estimated_quads_ = before.back();
  const auto splat_at = [&](double quads) {
    const auto splat =
        static_cast<std::uint32_t>(std::lower_bound(before.begin(), before.end(), quads) - before.begin());
    return std::min(splat, frame.splats()) / splats_per_vertex_warp * splats_per_vertex_warp;
  };
  const double begin = measured_quads;
  // There the estimate may be five times too high without a window that reaches beyond the frame.
  const double end = std::max(begin, estimated_quads_ - 4 * (warm_up_quads_ + measured_quads));
  const std::uint64_t strata = request.sampling->windows != 0 ? request.sampling->windows : facts_of(request).usual;
  const double length = (end - begin) / static_cast<double>(strata);
  windows_.push_back({0, splat_at(begin)});
  for (std::uint64_t i = 0; i < strata; ++i) {
    const double from = begin + length * static_cast<double>(i);
    const double drawn = static_cast<double>(mix(request.sampling->seed ^ mix(i)) >> 11U) * 0x1p-53;  // in [0, 1)
    const double at = from + drawn * std::max(0.0, length - measured_quads);
    windows_.push_back({splat_at(at - warm_up_quads_), splat_at(from + length)});
  }
  windows_.push_back({splat_at(end - warm_up_quads_), frame.splats()});
}

double FrameSampler::share() const {
  const double quads = static_cast<double>(windows_.size()) * (measured_quads + warm_up_quads_);
  return quads / std::max(estimated_quads_, 1.0);
}

void FrameSampler::begin(const UntimedGpu& gpu, const Framebuffer& framebuffer) {
  gpu_ = &gpu;
  drawn_ = &framebuffer;
  progress_.emplace(gpu);
  steps_.assign(1, {});
  own_ = framebuffer;
  passed();
}

void FrameSampler::take_step() {
  steps_.push_back({progress_->splats(), progress_->counts().primitives, static_cast<double>(progress_->rasterized()),
                    progress_->work()});
}

void FrameSampler::passed() {
  if (static_cast<double>(progress_->rasterized()) >= steps_.back().quads + quads_of_step) take_step();
  while (next_ < windows_.size() && progress_->splats() >= windows_[next_].splat) begin(windows_[next_++]);
}

void FrameSampler::begin(Window& window) {
  end_window();
  const bool is_first = &window == &windows_.front();
  own_.color = drawn_->color;
  own_.depth_stencil = drawn_->depth_stencil;
  if (!is_first) own_.depth_stencil.go_on();
  const SampledWindow::Range range{is_first ? 0 : warm_up_quads_, measured_quads, &window == &windows_.back()};
  window.from = static_cast<double>(progress_->rasterized()) + range.from;
  window.to = window.from + measured_quads;
  window.primitives_from = window.primitives_to = progress_->counts().primitives;
  under_way_ = &window;
  run_ = std::make_unique<SampledWindow>(request_,
                                         frame_.part(static_cast<std::uint32_t>(progress_->splats()), frame_.splats()),
                                         range, *gpu_, own_);
}

void FrameSampler::end_window() {
  if (run_ == nullptr) return;
  const SampledWindow::Measured measured = run_->result();
  run_.reset();
  under_way_->cycles = measured.cycle_to - measured.cycle_from;
  under_way_->delay_growth = measured.delay_growth;
  under_way_->primitives_from += measured.primitives_from;
  under_way_->primitives_to += measured.primitives_to;
  measured_ += under_way_->cycles;
  warm_up_ += measured.cycle_from;
  kernel_events_ += measured.kernel_events;
  is_whole_ = is_whole_ && measured.is_whole;
}

void FrameSampler::end() {
  end_window();
  take_step();
  find_in_course();
  find_busiest();
}

/// TGC holds primitives when a window begins, and the window's own is empty then: its quads are later ones.
void FrameSampler::find_in_course() {
  for (std::size_t i = 1; i < windows_.size(); ++i) {
    Window& window = windows_[i];
    const double from_later = quads_at_primitive(window.primitives_from) - window.from;
    const double to_later = quads_at_primitive(window.primitives_to) - window.to;
    const double later = i + 1 == windows_.size() ? from_later : (from_later + to_later) / 2;
    window.from += later;
    window.to += later;
    window.lead_growth = to_later - from_later;
  }
}

/// Of each step the kind of work that takes longest, where an item takes what it does in the tenth of windows that are through with
/// it soonest.
void FrameSampler::find_busiest() {
  SampledWork prices{};
  for (std::size_t kind = 0; kind < counted_work_kinds; ++kind) {
    std::vector<double> of_windows;
    for (std::size_t i = 1; i + 1 < windows_.size(); ++i) {
      const double work = work_between(windows_[i].from, windows_[i].to)[kind];
      if (work > 0) of_windows.push_back(windows_[i].cycles / work);
    }
    if (of_windows.empty()) continue;
    std::sort(of_windows.begin(), of_windows.end());
    prices[kind] = of_windows[of_windows.size() / 10];
  }
  for (std::size_t i = 1; i < steps_.size(); ++i) {
    double busiest = 0;
    for (std::size_t kind = 0; kind < counted_work_kinds; ++kind)
      busiest = std::max(busiest, prices[kind] * (steps_[i].work[kind] - steps_[i - 1].work[kind]));
    steps_[i].work.back() = steps_[i - 1].work.back() + busiest;
  }
}

namespace {
/// What goes on evenly from one step to the next, where another quantity has a value.
template <class Step, class Of, class At>
double interpolated(const std::vector<Step>& steps, double value, const At& at, const Of& of) {
  const auto next = std::lower_bound(steps.begin(), steps.end(), value,
                                     [&](const Step& step, double wanted) { return at(step) < wanted; });
  if (next == steps.end()) return of(steps.back());
  if (next == steps.begin()) return of(steps.front());
  const Step& before = *(next - 1);
  const double share = (value - at(before)) / (at(*next) - at(before));
  return of(before) + share * (of(*next) - of(before));
}
}  // namespace

double FrameSampler::quads_at_primitive(std::uint64_t primitive) const {
  return interpolated(
      steps_, static_cast<double>(primitive), [](const Step& step) { return static_cast<double>(step.primitives); },
      [](const Step& step) { return step.quads; });
}

double FrameSampler::quads_at_splat(std::uint32_t splat) const {
  return interpolated(
      steps_, splat, [](const Step& step) { return static_cast<double>(step.splats); },
      [](const Step& step) { return step.quads; });
}

SampledWork FrameSampler::work_between(double from, double to) const {
  SampledWork work{};
  for (std::size_t kind = 0; kind < work.size(); ++kind) {
    const auto at = [&](double quads) {
      return interpolated(
          steps_, quads, [](const Step& step) { return step.quads; },
          [&](const Step& step) { return step.work[kind]; });
    };
    work[kind] = at(to) - at(from);
  }
  return work;
}

template <class OfWindow, class Whole>
FrameSampler::Growth FrameSampler::growth(const OfWindow& of_window, const Whole& whole) const {
  double sum = 0, squares = 0, wholes = 0;
  const std::size_t between = windows_.size() - 2;
  for (std::size_t i = 1; i <= between; ++i) {
    const double grown = of_window(windows_[i]);
    sum += grown;
    squares += grown * grown;
    wholes += whole(windows_[i]);
  }
  const auto count = static_cast<double>(between);
  const double deviation = std::sqrt(std::max(0.0, count * squares - sum * sum) / (count - 1));
  return {100 * sum / wholes, 100 * deviation / wholes};
}

std::optional<FrameSampler::Result> FrameSampler::result() const {
  if (!is_whole_) return std::nullopt;
  const Window& head = windows_.front();
  const Window& tail = windows_.back();
  std::vector<SampledStratum> strata;
  double from = head.to;
  for (std::size_t i = 1; i + 1 < windows_.size(); ++i) {
    const Window& window = windows_[i];
    const bool is_last = i + 2 == windows_.size();
    const double to = std::max(from, is_last ? tail.from : quads_at_splat(window.stratum_end));
    strata.push_back({to - from, work_between(from, to), window.to - window.from, work_between(window.from, window.to),
                      window.cycles});
    from = to;
  }
  const EstimatedTime middle = estimate_time(strata);
  const double cycles = middle.cycles + head.cycles + tail.cycles;
  Result result;
  result.cycles = static_cast<std::uint64_t>(cycles + 0.5);
  result.kernel_events = kernel_events_;
  result.report.windows = windows_.size();
  result.report.measured_share = measured_ / cycles;
  result.report.warm_up_share = warm_up_ / cycles;
  const Growth delay = growth([](const Window& window) { return window.delay_growth; },
                              [](const Window& window) { return window.cycles; });
  const Growth lead =
      growth([](const Window& window) { return window.lead_growth; }, [](const Window&) { return measured_quads; });
  result.report.delay_growth_percent = delay.percent;
  result.report.lead_growth_percent = lead.percent;
  result.front_end_is_settled = lead.is_within(most_lead_percent);
  result.is_settled = result.front_end_is_settled && delay.is_within(most_delay_percent);
  result.report.half_interval_percent = 100 * middle.half_width / cycles + facts_of(request_).bias_percent;
  return result;
}

}  // namespace vrpipe
