#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <vrpipe/pipeline/frame.h>

namespace vrpipe {

/// Quads that are rasterised before each splat of a frame, and in all: about, since neither what is hidden nor what is thinner than
/// its box is known.
std::vector<double> estimated_course(const Frame& frame);

/// Which windows of a frame are simulated, and what each of them stands for. The first is from the beginning on, the last to the
/// end; between them the frame is parted into strata, of each of which one window, at a random place, is taken:
///
/// * where a clear or a draw of another state comes, and nothing like it near by, as many quads before and behind it as a window
///   has: what waits there takes long, and is found in few windows at random places. Of such places between the same two states
///   some stand for all;
/// * the rest, by states: draws of another state may take far more or less for the same work.
class WindowPlan {
 public:
  struct Sizes {
    double warm_up = 0, measured = 0;  ///< quads of a window
    std::uint64_t strata = 0;          ///< about
    std::uint64_t seed = 0;
  };
  /// From a place to another: splats of the frame that are drawn before it.
  struct PlaceRange {
    double from, to;
  };
  struct Window {
    std::uint32_t splat = 0;          ///< with which warming up begins
    double warm_up = 0;               ///< quads until it measures
    std::optional<DrawIndex> around;  ///< it measures as many quads before this draw as behind that
    std::size_t group = 0;            ///< strata of a state, or at places between the same states, have the same number
    // Its stratum:
    std::vector<PlaceRange> ranges;      ///< but for what is about changes
    std::vector<DrawIndex> about_draws;  ///< what is about their beginnings
  };

  /// The frame and the course outlive it.
  /// @param course  as estimated_course
  WindowPlan(const Frame& frame, const std::vector<double>& course, const Sizes& sizes);

  /// In the order of the frame.
  const std::vector<Window>& windows() const { return windows_; }
  /// Draws whose beginnings are strata of their own, in order.
  const std::vector<DrawIndex>& changes() const { return changes_; }
  /// What is between the first window and the last.
  PlaceRange middle() const { return {place_in_course(begin_), place_in_course(end_)}; }
  /// Of the frame that is simulated.
  double share() const;

 private:
  struct Range {
    double from, to;  ///< quads of the course
  };
  using Ranges = std::vector<Range>;
  /// A change of what is drawn.
  struct Change {
    DrawIndex draw;
    const DrawState* before;
  };
  struct Group {
    const DrawState* before;  ///< null where it is no change
    const DrawState* state;   ///< null where changes are near one another
    Ranges ranges;
    std::vector<DrawIndex> changes;
  };
  std::vector<Change> all_changes() const;
  /// Takes those that nothing is near to, and returns what of the course they and the others are about.
  Ranges take_changes();
  void take_states(const Ranges& without);
  Group& group_of(const DrawState* before, const DrawState* state);
  void take_windows(std::size_t group);
  void take_windows_at_changes(std::size_t group);
  Window window_at(double quads) const;
  double place_in_course(double quads) const;
  double begin_of(DrawIndex draw) const { return course_[frame_.draw_call(draw).base]; }
  static double quads_in(const Ranges& ranges);
  static Ranges part_of(const Ranges& ranges, double from, double to);
  double random();  ///< in [0, 1)

  const Frame& frame_;
  const std::vector<double>& course_;
  const Sizes sizes_;
  double begin_ = 0, end_ = 0;  ///< of what is between the first window and the last
  std::uint64_t drawn_ = 0;
  std::vector<Group> groups_;
  std::vector<Window> windows_;
  std::vector<DrawIndex> changes_;
};

}  // namespace vrpipe
