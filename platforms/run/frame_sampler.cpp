#include "run/frame_sampler.h"

#include <algorithm>
#include <cmath>
#include <functional>
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
  double warm_up_quads;   ///< of each GPC, whose queues are its own
  double bias_percent;    ///< of windows that begin otherwise than the frame goes on, whatever their number
  double spread_percent;  ///< half the interval times the root of the number of windows
  std::uint64_t usual;    ///< windows, where nobody says how many
};
constexpr WindowFacts facts_without_termination{20000, 0.3, 4, 24};
constexpr WindowFacts facts_with_termination{80000, 1.5, 13, 40};
const WindowFacts& facts_of(const RunRequest& request) {
  return request.variant.early_termination ? facts_with_termination : facts_without_termination;
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

FrameSampler::FrameSampler(const RunRequest& request, const Frame& frame, unsigned warm_up_times,
                           const std::vector<double>& course)
    : request_(request),
      frame_(frame),
      plan_(frame, course,
            {facts_of(request).warm_up_quads * warm_up_times * gpcs_of(request), measured_quads,
             request.sampling->windows != 0 ? request.sampling->windows : facts_of(request).usual,
             request.sampling->seed}) {
  request_.sampling.reset();
  request_.observers = nullptr;
  request_.reads_statistics = false;
  for (const WindowPlan::Window& planned : plan_.windows()) windows_.push_back({planned});
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
  steps_.push_back({progress_->splats(), progress_->counts().primitives, progress_->set_up(),
                    static_cast<double>(progress_->rasterized()), progress_->work()});
}

void FrameSampler::passed() {
  const std::uint64_t splats = progress_->splats();
  bool ends_draw = false;  // after which splats may be far larger
  for (; draw_ < frame_.draws().size() && frame_.draws()[draw_].base + frame_.draws()[draw_].splats <= splats; ++draw_)
    ends_draw = true;
  if (ends_draw || static_cast<double>(progress_->rasterized()) >= steps_.back().quads + quads_of_step) take_step();
  while (next_ < windows_.size() && splats >= windows_[next_].planned.splat) begin(windows_[next_++]);
}

void FrameSampler::begin(Window& window) {
  end_window();
  if (!is_whole_) return;  // nothing comes of any more
  const bool is_first = &window == &windows_.front();
  own_.color = drawn_->color;
  own_.depth_stencil = drawn_->depth_stencil;
  if (!is_first) own_.depth_stencil.go_on();
  SampledWindow::Range range;
  range.from = window.planned.warm_up;
  range.quads = measured_quads;
  range.around = window.planned.around;
  range.to_end = &window == &windows_.back();
  window.begin = static_cast<double>(progress_->rasterized());
  window.set_up_or_held = progress_->set_up() + progress_->held();
  window.primitives_from = window.primitives_to = progress_->counts().primitives;
  under_way_ = &window;
  run_ = std::make_unique<SampledWindow>(request_, frame_.gone_on_with(static_cast<std::uint32_t>(progress_->splats())),
                                         range, *gpu_, own_);
}

void FrameSampler::end_window() {
  if (run_ == nullptr) return;
  const SampledWindow::Measured measured = run_->result();
  run_.reset();
  under_way_->from = under_way_->begin + measured.from;
  under_way_->to = under_way_->begin + measured.to;
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

/// TGC holds primitives when a window begins, and the window's own is empty then: its quads are later ones, by about those of as
/// many primitives.
void FrameSampler::find_in_course() {
  for (std::size_t i = 1; i < windows_.size(); ++i) {
    Window& window = windows_[i];
    const double ahead_from = quads_at_primitive(window.primitives_from) - window.from;
    const double ahead_to = quads_at_primitive(window.primitives_to) - window.to;
    window.lead_growth = ahead_to - ahead_from;
    const double later = quads_at_setup(window.set_up_or_held) - window.begin;
    window.from += later;
    window.to += later;
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

double FrameSampler::quads_at_setup(std::uint64_t setup) const {
  return interpolated(
      steps_, static_cast<double>(setup), [](const Step& step) { return static_cast<double>(step.set_up); },
      [](const Step& step) { return step.quads; });
}

double FrameSampler::quads_at_splat(double splat) const {
  return interpolated(
      steps_, splat, [](const Step& step) { return static_cast<double>(step.splats); },
      [](const Step& step) { return step.quads; });
}

std::vector<double> FrameSampler::course() const {
  std::vector<double> course;
  for (std::uint32_t splat = 0; splat <= frame_.splats(); ++splat) course.push_back(quads_at_splat(splat));
  return course;
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

/// Whether another draw begins in it, or where it warms up.
bool FrameSampler::is_at_change(const Window& window) const {
  return std::any_of(frame_.draws().begin(), frame_.draws().end(), [&](const DrawCall& call) {
    return call.base > 0 && call.base >= window.planned.splat && quads_at_splat(call.base) < window.to;
  });
}

template <class OfWindow, class Whole>
FrameSampler::Growth FrameSampler::growth(const OfWindow& of_window, const Whole& whole) const {
  double sum = 0, squares = 0, wholes = 0;
  std::size_t between = 0;
  for (std::size_t i = 1; i + 1 < windows_.size(); ++i) {
    if (is_at_change(windows_[i])) continue;  // where they empty and fill in the frame, too
    ++between;
    const double grown = of_window(windows_[i]);
    sum += grown;
    squares += grown * grown;
    wholes += whole(windows_[i]);
  }
  if (between < 2) return {0, 0};
  const auto count = static_cast<double>(between);
  const double deviation = std::sqrt(std::max(0.0, count * squares - sum * sum) / (count - 1));
  return {100 * sum / wholes, 100 * deviation / wholes};
}

/// Of the course without time. The first window and the last are where they are.
std::vector<std::pair<double, double>> FrameSampler::quads_of(const WindowPlan::Window& planned) const {
  const double half = measured_quads / 2;
  const double first = windows_.front().to, last = windows_.back().from;
  const auto change_at = [&](DrawIndex draw) { return quads_at_splat(frame_.draw_call(draw).base); };
  std::vector<std::pair<double, double>> parts;
  const auto add = [&](double from, double to) {
    from = std::max(from, first);
    to = std::min(to, last);
    if (from < to) parts.emplace_back(from, to);
  };
  for (const DrawIndex draw : planned.about_draws) add(change_at(draw) - half, change_at(draw) + half);
  const WindowPlan::PlaceRange middle = plan_.middle();
  for (const WindowPlan::PlaceRange& range : planned.ranges) {
    double from = range.from <= middle.from ? first : quads_at_splat(range.from);
    const double to = range.to >= middle.to ? last : quads_at_splat(range.to);
    for (const DrawIndex draw : plan_.changes()) {
      const double change = change_at(draw);
      if (change + half <= from || change - half >= to) continue;
      add(from, change - half);
      from = change + half;
    }
    add(from, to);
  }
  return parts;
}

std::optional<FrameSampler::Result> FrameSampler::result() const {
  if (!is_whole_) return std::nullopt;
  const Window& head = windows_.front();
  const Window& tail = windows_.back();
  std::vector<SampledStratum> strata;
  for (std::size_t i = 1; i + 1 < windows_.size(); ++i) {
    const Window& window = windows_[i];
    SampledStratum stratum;
    stratum.group = window.planned.group;
    for (const auto& [from, to] : quads_of(window.planned)) {
      stratum.quads += to - from;
      const SampledWork work = work_between(from, to);
      std::transform(work.begin(), work.end(), stratum.work.begin(), stratum.work.begin(), std::plus<>());
    }
    stratum.window_quads = window.to - window.from;
    stratum.window_work = work_between(window.from, window.to);
    stratum.window_cycles = window.cycles;
    strata.push_back(stratum);
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
