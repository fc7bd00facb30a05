#include "run/window_plan.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <vrpipe/arithmetic/random.h>

namespace vrpipe {

namespace {

// Of states, and of pairs of them; those beyond are taken for one.
constexpr std::size_t most_groups = 8;

/// The share of a range around a centre that is from 0 to `size`.
double share_on_screen(double center, double extent, double size) {
  return std::max(0.0, std::min(center + extent, size) - std::max(center - extent, 0.0)) / std::max(2 * extent, 1e-9);
}

// Quads of what is drawn, about: those in it and half of those that its edges cross, where they are on the screen.

double quads_of(const Splat& splat, const Frame& frame) {
  const double across = std::sqrt(double{splat.ax} * splat.ax + double{splat.ay} * splat.ay);
  const double along = std::sqrt(double{splat.bx} * splat.bx + double{splat.by} * splat.by);
  return (across * along + across + along + 1) *
         share_on_screen(splat.cx, std::fabs(splat.ax) + std::fabs(splat.bx), frame.width()) *
         share_on_screen(splat.cy, std::fabs(splat.ay) + std::fabs(splat.by), frame.height());
}

/// Above 0 where a mesh turns its back.
double doubled_area_of(const ScreenTriangle& triangle) {
  const auto& [x, y] = triangle;
  return (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
}

double quads_of(const ScreenTriangle& triangle, const Frame& frame) {
  const auto& [x, y] = triangle;
  const double area = std::fabs(doubled_area_of(triangle)) / 2;
  double perimeter = 0;
  for (unsigned i = 0; i < 3; ++i) perimeter += std::hypot(x[(i + 1) % 3] - x[i], y[(i + 1) % 3] - y[i]);
  const auto [left, right] = std::minmax({x[0], x[1], x[2]});
  const auto [top, bottom] = std::minmax({y[0], y[1], y[2]});
  return (area / 4 + perimeter / 4 + 0.5) * share_on_screen((left + right) / 2, (right - left) / 2, frame.width()) *
         share_on_screen((top + bottom) / 2, (bottom - top) / 2, frame.height());
}

double quads_of(const DrawCall& call, std::uint32_t number, const Frame& frame) {
  if (!call.geometry->is_mesh()) {
    const ScreenTriangle* const triangle = call.triangle(number);
    return triangle != nullptr ? quads_of(*triangle, frame) : quads_of(call.splat(number), frame);
  }
  const auto& [a, b, c] = call.mesh_triangle(number).vertices;
  const ScreenTriangle triangle{{a.x, b.x, c.x}, {a.y, b.y, c.y}};
  const bool is_back = doubled_area_of(triangle) > 0;
  const bool is_culled = call.state.cull != CullMode::none && is_back == (call.state.cull == CullMode::back);
  return is_culled ? 0 : quads_of(triangle, frame);
}

bool are_equal(const DrawState* a, const DrawState* b) { return a == b || (a != nullptr && b != nullptr && *a == *b); }

}  // namespace

std::vector<double> estimated_course(const Frame& frame) {
  std::vector<double> course{0};
  for (const DrawCall& call : frame.draws()) {
    for (std::uint32_t i = call.base; i < call.base + call.splats; ++i)
      course.push_back(course.back() + quads_of(call, i, frame));
  }
  return course;
}

WindowPlan::WindowPlan(const Frame& frame, const std::vector<double>& course, const Sizes& sizes)
    : frame_(frame), course_(course), sizes_(sizes) {
  begin_ = sizes.measured;
  // There the estimate may be five times too high without a window that reaches beyond the frame.
  end_ = std::max(begin_, course.back() - 4 * (sizes.warm_up + sizes.measured));
  take_states(take_changes());
  if (groups_.empty()) groups_.push_back({nullptr, nullptr, {{begin_, end_}}, {}});
  for (std::size_t group = 0; group < groups_.size(); ++group) {
    if (groups_[group].changes.empty()) {
      take_windows(group);
    } else {
      take_windows_at_changes(group);
    }
  }
  std::stable_sort(windows_.begin(), windows_.end(),
                   [](const Window& a, const Window& b) { return a.splat < b.splat; });
  windows_.insert(windows_.begin(), Window());
  windows_.push_back(window_at(end_));
}

double WindowPlan::share() const {
  double quads = 0;
  for (const Window& window : windows_) quads += window.warm_up + sizes_.measured;
  return quads / std::max(course_.back(), 1.0);
}

std::vector<WindowPlan::Change> WindowPlan::all_changes() const {
  std::vector<Change> changes;
  const DrawState* before = nullptr;
  bool is_cleared = false;
  for (const Frame::Command& command : frame_.commands()) {
    if (!command.is_draw) {
      is_cleared = true;
      continue;
    }
    const DrawCall& call = frame_.draw_call(command.draw);
    if (call.splats == 0) continue;
    if (before != nullptr && (is_cleared || !(*before == call.state))) changes.push_back({command.draw, before});
    before = &call.state;
    is_cleared = false;
  }
  return changes;
}

WindowPlan::Ranges WindowPlan::take_changes() {
  const double half = sizes_.measured / 2;
  Ranges about;
  const std::vector<Change> changes = all_changes();
  for (std::size_t first = 0, last = 0; first < changes.size(); first = last + 1) {
    const auto at = [&](std::size_t change) { return begin_of(changes[change].draw); };
    for (last = first; last + 1 < changes.size() && at(last + 1) - at(last) < 2 * half;) ++last;
    const Range range{std::max(at(first) - half, begin_), std::min(at(last) + half, end_)};
    if (range.from >= range.to) continue;
    if (last > first) {
      group_of(nullptr, nullptr).ranges.push_back(range);
    } else if (range.to - range.from == 2 * half) {
      const auto [draw, before] = changes[first];
      group_of(before, &frame_.draw_call(draw).state).changes.push_back(draw);
      changes_.push_back(draw);
    } else {
      continue;
    }
    about.push_back(range);
  }
  return about;
}

void WindowPlan::take_states(const Ranges& without) {
  auto next = without.begin();
  for (const DrawCall& call : frame_.draws()) {
    double from = std::max(course_[call.base], begin_);
    const double to = std::min(course_[call.base + call.splats], end_);
    while (from < to) {
      while (next != without.end() && next->to <= from) ++next;
      const double until = next == without.end() ? to : std::min(to, next->from);
      if (from < until) group_of(nullptr, &call.state).ranges.push_back({from, until});
      from = until < to ? next->to : to;
    }
  }
}

WindowPlan::Group& WindowPlan::group_of(const DrawState* before, const DrawState* state) {
  const bool is_change = before != nullptr;
  std::size_t alike = 0;
  Group* last = nullptr;
  for (Group& group : groups_) {
    if (are_equal(group.before, before) && are_equal(group.state, state)) return group;
    if ((group.before != nullptr) != is_change || group.state == nullptr) continue;
    ++alike;
    last = &group;
  }
  if (alike == most_groups && state != nullptr) return *last;
  groups_.push_back({before, state, {}, {}});
  return groups_.back();
}

void WindowPlan::take_windows(std::size_t group) {
  const Ranges& ranges = groups_[group].ranges;
  const double quads = quads_in(ranges);
  const double share = static_cast<double>(sizes_.strata) * quads / std::max(end_ - begin_, 1.0);
  const double count = std::max(quads >= 2 * sizes_.measured ? 2.0 : 1.0, std::round(share));
  const double length = quads / count;
  for (double i = 0; i < count; ++i) {
    const Ranges stratum = part_of(ranges, length * i, i + 1 == count ? quads : length * (i + 1));
    const double at = random() * std::max(0.0, length - sizes_.measured);
    const Range rest = part_of(stratum, at, length).front();
    const Range whole =
        *std::find_if(ranges.begin(), ranges.end(), [&](const Range& each) { return rest.from <= each.to; });
    // Not beyond what is of this state, if that is long enough.
    Window window = window_at(std::max(whole.from, std::min(rest.from, whole.to - sizes_.measured)));
    window.group = group;
    for (const Range& range : stratum)
      window.ranges.push_back({place_in_course(range.from), place_in_course(range.to)});
    windows_.push_back(std::move(window));
  }
}

void WindowPlan::take_windows_at_changes(std::size_t group) {
  const std::vector<DrawIndex>& changes = groups_[group].changes;
  const std::size_t count = std::min<std::size_t>(changes.size(), std::max<std::uint64_t>(2, sizes_.strata / 8));
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t from = changes.size() * i / count, to = changes.size() * (i + 1) / count;
    const DrawIndex draw = changes[from + static_cast<std::size_t>(random() * static_cast<double>(to - from))];
    Window window = window_at(begin_of(draw) - sizes_.measured / 2);
    window.group = group;
    window.around = draw;
    for (std::size_t at = from; at < to; ++at) window.about_draws.push_back(changes[at]);
    windows_.push_back(std::move(window));
  }
}

WindowPlan::Window WindowPlan::window_at(double quads) const {
  const auto place = static_cast<std::uint32_t>(place_in_course(std::max(0.0, quads - sizes_.warm_up)));
  Window window;
  window.splat = place;
  for (const DrawCall& call : frame_.draws()) {  // from the beginning of its vertex warp on
    if (place - call.base < call.splats)
      window.splat = call.base + (place - call.base) / splats_per_vertex_warp * splats_per_vertex_warp;
  }
  window.warm_up = quads - course_[window.splat];
  return window;
}

/// The splat, and the part of it, before which so many quads are; where something about a change ends, the change.
double WindowPlan::place_in_course(double quads) const {
  const double half = sizes_.measured / 2;
  const auto change = std::lower_bound(changes_.begin(), changes_.end(), quads - sizes_.measured,
                                       [&](DrawIndex draw, double at) { return begin_of(draw) < at; });
  for (auto draw = change; draw != changes_.end() && begin_of(*draw) <= quads + sizes_.measured; ++draw) {
    if (quads == begin_of(*draw) - half || quads == begin_of(*draw) + half) return frame_.draw_call(*draw).base;
  }
  const auto next = std::upper_bound(course_.begin(), course_.end(), quads);
  if (next == course_.end()) return static_cast<double>(course_.size() - 1);
  const double before = *(next - 1);
  return static_cast<double>(next - 1 - course_.begin()) + (quads - before) / (*next - before);
}

double WindowPlan::quads_in(const Ranges& ranges) {
  double quads = 0;
  for (const Range& range : ranges) quads += range.to - range.from;
  return quads;
}

/// What is from a place in ranges, one behind the other, to another place; not empty.
WindowPlan::Ranges WindowPlan::part_of(const Ranges& ranges, double from, double to) {
  Ranges part;
  double before = 0;
  for (const Range& range : ranges) {
    const double behind = before + (range.to - range.from);
    if (behind > from && before < to) {
      part.push_back({from <= before ? range.from : range.from + (from - before),
                      to >= behind ? range.to : range.from + (to - before)});
    }
    before = behind;
  }
  if (part.empty()) part.push_back({ranges.back().to, ranges.back().to});
  return part;
}

double WindowPlan::random() { return static_cast<double>(mix(sizes_.seed ^ mix(drawn_++)) >> 11U) * 0x1p-53; }

}  // namespace vrpipe
