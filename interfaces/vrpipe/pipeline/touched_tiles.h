#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include <vrpipe/pipeline/draw.h>
#include <vrpipe/pipeline/geometry.h>
#include <vrpipe/pipeline/payload.h>

namespace vrpipe {

/// By which shape a splat is listed in tiles.
enum class ListShape : std::uint8_t {
  three_sigma,  ///< the square of three sigmas of the longer axis around it, as published
  box,          ///< the axis-aligned box of its ellipse at alpha 1/255
  oriented,     ///< the oriented box of that ellipse
  ellipse,      ///< the ellipse
};

/// Whether a splat has a covariance that can be inverted; the others are in no list, as published.
inline bool has_area(const Splat& splat) {
  const double determinant = double{splat.ax} * double{splat.by} - double{splat.ay} * double{splat.bx};
  return is_finite(splat) && splat.r > 0 && determinant != 0;
}

/// Which tiles of an image a splat touches, by one shape. A tile is the rectangle of its pixels' samples: what passes
/// between them is seen by no pixel.
class TouchedTiles {
 public:
  /// width, height and the side of a tile in pixels.
  TouchedTiles(ListShape shape, std::uint32_t width, std::uint32_t height, std::uint32_t side = screen_tile_pixels)
      : shape_(shape),
        width_(static_cast<int>(width)),
        height_(static_cast<int>(height)),
        side_(static_cast<int>(side)) {}

  /// Calls `touched(x, y)` for each, row by row. The splat has an area.
  template <class Touched>
  void visit(const Splat& splat, Touched&& touched) const {
    constexpr std::int32_t beyond = std::numeric_limits<std::int32_t>::max();
    visit(splat, {0, 0, beyond, beyond}, std::forward<Touched>(touched));
  }
  /// Of those of a rectangle of tiles. Gives how many the shape was tested against.
  template <class Touched>
  std::uint64_t visit(const Splat& splat, const PixelRect& within, Touched&& touched) const {
    const Ellipse of(splat);
    const PixelRect tiles = intersection(shape_ == ListShape::three_sigma ? square(splat) : box(of), within);
    if (tiles.empty()) return 0;
    for (int y = tiles.y0; y < tiles.y1; ++y) {
      for (int x = tiles.x0; x < tiles.x1; ++x) {
        if (is_touched(of, x, y)) touched(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y));
      }
    }
    return static_cast<std::uint64_t>(tiles.x1 - tiles.x0) * static_cast<std::uint64_t>(tiles.y1 - tiles.y0);
  }

 private:
  /// That at whose edge alpha is 1/255: its half axes are those of the splat's box.
  struct Ellipse {
    explicit Ellipse(const Splat& splat)
        : cx(splat.cx), cy(splat.cy), ax(splat.ax), ay(splat.ay), bx(splat.bx), by(splat.by) {
      const double determinant = ax * by - ay * bx;
      const double m00 = by / determinant;
      const double m01 = -bx / determinant;
      const double m10 = -ay / determinant;
      const double m11 = ax / determinant;
      xx = m00 * m00 + m10 * m10;
      xy = m00 * m01 + m10 * m11;
      yy = m01 * m01 + m11 * m11;
    }
    /// 1 at its edge.
    double at(double dx, double dy) const { return xx * dx * dx + 2 * xy * dx * dy + yy * dy * dy; }

    double cx, cy, ax, ay, bx, by;
    double xx, xy, yy;
  };

  /// Tiles whose samples lie between, clipped to the image.
  void tiles_between(double low, double high, int pixels, std::int32_t& first, std::int32_t& end) const {
    const double last_pixel = pixels - 1;
    const double from = std::ceil(std::max(low - 0.5, 0.0));
    const double to = std::floor(std::min(high - 0.5, last_pixel));
    if (!(from <= to)) {
      first = end = 0;
      return;
    }
    first = static_cast<std::int32_t>(from) / side_;
    end = static_cast<std::int32_t>(to) / side_ + 1;
  }

  PixelRect box(const Ellipse& of) const {
    const bool is_oriented = shape_ == ListShape::oriented;
    const double half_width =
        is_oriented ? std::fabs(of.ax) + std::fabs(of.bx) : std::sqrt(of.ax * of.ax + of.bx * of.bx);
    const double half_height =
        is_oriented ? std::fabs(of.ay) + std::fabs(of.by) : std::sqrt(of.ay * of.ay + of.by * of.by);
    PixelRect tiles;
    tiles_between(of.cx - half_width, of.cx + half_width, width_, tiles.x0, tiles.x1);
    tiles_between(of.cy - half_height, of.cy + half_height, height_, tiles.y0, tiles.y1);
    return tiles;
  }

  /// As published (getRect), in single precision, with pixels' samples at whole numbers.
  PixelRect square(const Splat& splat) const {
    const double r = splat.r;
    const double a = std::sqrt(double{splat.ax} * splat.ax + double{splat.ay} * splat.ay) / r;
    const double b = std::sqrt(double{splat.bx} * splat.bx + double{splat.by} * splat.by) / r;
    const float radius = std::ceil(3.0F * static_cast<float>(std::max(a, b)));
    const auto tile = [side = side_](float pixels, int along) {
      const int tiles = (along + side - 1) / side;
      const float quotient = pixels / static_cast<float>(side);
      if (!(quotient > 0)) return 0;
      return quotient < static_cast<float>(tiles) ? static_cast<int>(quotient) : tiles;
    };
    const float x = splat.cx - 0.5F;
    const float y = splat.cy - 0.5F;
    const auto rest = static_cast<float>(side_ - 1);
    return {tile(x - radius, width_), tile(y - radius, height_), tile(x + radius + rest, width_),
            tile(y + radius + rest, height_)};
  }

  bool is_touched(const Ellipse& of, int x, int y) const {
    if (shape_ == ListShape::three_sigma || shape_ == ListShape::box) return true;
    // The samples of the tile's pixels, about the splat's centre.
    const double left = side_ * x + 0.5 - of.cx;
    const double top = side_ * y + 0.5 - of.cy;
    const double right = std::min(side_ * (x + 1), width_) - 0.5 - of.cx;
    const double bottom = std::min(side_ * (y + 1), height_) - 0.5 - of.cy;
    return shape_ == ListShape::oriented ? box_touches(of, left, top, right, bottom)
                                         : ellipse_touches(of, left, top, right, bottom);
  }

  /// By separating axes: those of the box; those of the tile have chosen the tile.
  static bool box_touches(const Ellipse& of, double left, double top, double right, double bottom) {
    const double dx = (left + right) / 2;
    const double dy = (top + bottom) / 2;
    const double half_width = (right - left) / 2;
    const double half_height = (bottom - top) / 2;
    const auto reaches = [&](double ax, double ay) {
      return std::fabs(dx * ax + dy * ay) <=
             ax * ax + ay * ay + std::fabs(ax) * half_width + std::fabs(ay) * half_height;
    };
    return reaches(of.ax, of.ay) && reaches(of.bx, of.by);
  }

  /// By the place on the tile's edges that lies nearest, in the ellipse's measure.
  static bool ellipse_touches(const Ellipse& of, double left, double top, double right, double bottom) {
    if (left <= 0 && right >= 0 && top <= 0 && bottom >= 0) return true;
    const auto within = [](double low, double value, double high) { return std::min(std::max(low, value), high); };
    for (const double dx : {left, right}) {
      if (of.at(dx, within(top, -of.xy * dx / of.yy, bottom)) <= 1) return true;
    }
    for (const double dy : {top, bottom}) {
      if (of.at(within(left, -of.xy * dy / of.xx, right), dy) <= 1) return true;
    }
    return false;
  }

  ListShape shape_;
  int width_, height_, side_;
};

}  // namespace vrpipe
