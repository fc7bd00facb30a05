#pragma once

#include <cstdint>
#include <vector>

#include "surfaces.h"

namespace vrpipe {

/// A box or an ellipsoid that stops rays.
struct Blocker {
  Vec3 centre, half;
  bool ball;

  /// Whether it stops the ray between `from` and `from + reach * direction`. One that begins inside passes.
  bool blocks(const Vec3& from, const Vec3& direction, double reach) const;
};

/// Blockers, ordered so that a ray meets few of them.
class BlockerTree {
 public:
  BlockerTree() = default;
  explicit BlockerTree(std::vector<Blocker> blockers);

  /// Whether any of them blocks it.
  bool blocks(const Vec3& from, const Vec3& direction, double reach) const;

 private:
  struct Node {
    Vec3 low, high;
    std::uint32_t begin, end;  ///< of the blockers below
    std::uint32_t next;        ///< node after those below
  };
  void add_node(std::uint32_t begin, std::uint32_t end);

  std::vector<Blocker> blockers_;
  std::vector<Node> nodes_;  ///< each before those below it
};

}  // namespace vrpipe
