#include "blockers.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace vrpipe {
namespace {

constexpr std::uint32_t kLeaf = 4;

/// Whether the ray comes near the box; true in doubt. `inverse` of the direction, whose zeros are replaced.
bool meets(const Vec3& low, const Vec3& high, const Vec3& from, const Vec3& inverse, double reach) {
  double enter = 0, leave = reach;
  for (std::size_t i = 0; i < 3; ++i) {
    const double a = (low[i] - from[i]) * inverse[i], b = (high[i] - from[i]) * inverse[i];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave;
}

}  // namespace

bool Blocker::blocks(const Vec3& from, const Vec3& direction, double reach) const {
  const Vec3 o = from - centre;
  if (ball) {
    const Vec3 scale = {1 / half[0], 1 / half[1], 1 / half[2]};
    const Vec3 p = o * scale, d = direction * scale;
    const double a = dot(d, d), b = dot(p, d), c = dot(p, p) - 1;
    if (c <= 0 || b >= 0) return false;  // inside, or turned away
    const double discriminant = b * b - a * c;
    return discriminant > 0 && -b - std::sqrt(discriminant) < reach * a;
  }
  double enter = 1e-4, leave = reach;
  bool inside = true;
  for (std::size_t i = 0; i < 3 && enter <= leave; ++i) {
    inside = inside && std::fabs(o[i]) < half[i];
    if (std::fabs(direction[i]) < 1e-9) {
      if (std::fabs(o[i]) > half[i]) leave = -1;
      continue;
    }
    const double near_side = (-half[i] - o[i]) / direction[i];
    const double far_side = (half[i] - o[i]) / direction[i];
    enter = std::max(enter, std::min(near_side, far_side));
    leave = std::min(leave, std::max(near_side, far_side));
  }
  return !inside && enter < leave;
}

BlockerTree::BlockerTree(std::vector<Blocker> blockers) : blockers_(std::move(blockers)) {
  if (!blockers_.empty()) add_node(0, static_cast<std::uint32_t>(blockers_.size()));
}

void BlockerTree::add_node(std::uint32_t begin, std::uint32_t end) {
  Vec3 low = blockers_[begin].centre, high = low, first = low, last = low;
  for (std::uint32_t i = begin; i < end; ++i) {
    const Blocker& b = blockers_[i];
    // A hair more than they are, against rounding.
    const Vec3 half = b.half * 1.000001 + Vec3{1e-9, 1e-9, 1e-9};
    low = glm::min(low, b.centre - half);
    high = glm::max(high, b.centre + half);
    first = glm::min(first, b.centre);
    last = glm::max(last, b.centre);
  }
  const std::size_t node = nodes_.size();
  nodes_.push_back({low, high, begin, end, 0});
  if (end - begin > kLeaf) {
    const Vec3 spread = last - first;
    const std::size_t axis = spread[0] >= spread[1] && spread[0] >= spread[2] ? 0 : (spread[1] >= spread[2] ? 1 : 2);
    const std::uint32_t middle = begin + (end - begin) / 2;
    // Any order gives the same answers.
    std::nth_element(blockers_.begin() + begin, blockers_.begin() + middle, blockers_.begin() + end,
                     [axis](const Blocker& a, const Blocker& b) { return a.centre[axis] < b.centre[axis]; });
    add_node(begin, middle);
    add_node(middle, end);
  }
  nodes_[node].next = static_cast<std::uint32_t>(nodes_.size());
}

bool BlockerTree::blocks(const Vec3& from, const Vec3& direction, double reach) const {
  Vec3 inverse;
  for (std::size_t i = 0; i < 3; ++i) {
    inverse[i] = 1 / (std::fabs(direction[i]) < 1e-12 ? 1e-12 : direction[i]);
  }
  for (std::size_t i = 0; i < nodes_.size();) {
    const Node& node = nodes_[i];
    if (!meets(node.low, node.high, from, inverse, reach)) {
      i = node.next;
      continue;
    }
    if (node.end - node.begin <= kLeaf) {
      for (std::uint32_t b = node.begin; b < node.end; ++b) {
        if (blockers_[b].blocks(from, direction, reach)) return true;
      }
    }
    ++i;
  }
  return false;
}

}  // namespace vrpipe
