#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/component/statistic.h>

namespace vrpipe {

struct CountField;

/// Exact integers, of a frame; the names and rules are those of the contract. Units add what they count (Behaviour::add_to).
struct Counts {
  std::uint64_t primitives = 0;
  std::uint64_t quads_rasterized = 0, fragments_rasterized = 0;
  std::uint64_t quads_depth_stencil_failed = 0, fragments_depth_stencil_failed = 0;
  std::uint64_t quads_terminated = 0, fragments_terminated = 0;
  std::uint64_t quads_unshaded = 0, fragments_unshaded = 0;  ///< passed in draws that shade nothing
  std::uint64_t quads_shaded = 0, fragments_shaded = 0;
  std::uint64_t quads_pruned = 0, fragments_pruned = 0;
  std::uint64_t quads_merged = 0, fragments_merged = 0;
  std::uint64_t quads_dropped_late = 0, fragments_dropped_late = 0;
  std::uint64_t quads_late_failed = 0, fragments_late_failed = 0;
  std::uint64_t quads_unblended = 0, fragments_unblended = 0;  ///< passed late in draws that write no colour
  std::uint64_t quads_blended = 0, fragments_blended = 0;
  std::uint64_t warps = 0, tgc_flushes = 0, tc_flushes = 0, termination_updates = 0;

  /// All, in the order of the contract.
  static const std::vector<CountField>& fields();
  /// Name and value of each.
  std::vector<std::pair<std::string, std::uint64_t>> named() const;
};

struct CountField {
  const char* name;
  std::uint64_t Counts::*value;
  bool is_shared = false;  ///< by draws: nobody's own
  bool is_rare = false;    ///< in few frames: the others keep the hashes that they had before it was counted
};

/// What of a counter is to be added: all of it, or what is a draw's own.
class CountOf {
 public:
  CountOf() = default;
  explicit CountOf(std::size_t draw) : draw_(draw) {}
  std::uint64_t operator()(const Counter& counter) const { return draw_ ? 0 : counter.value(); }
  std::uint64_t operator()(const DrawCounter& counter) const {
    return draw_ ? counter.of_draw()[*draw_] : counter.value();
  }

 private:
  std::optional<std::size_t> draw_;
};

}  // namespace vrpipe
