#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include <vrpipe/kernel/accounting.h>

namespace vrpipe::tools {

/// Lines over an area.
enum class Hatch : std::uint8_t { none, rising, falling, level, dots };

/// How an area of a plot is filled: in steps of lightness, with lines where steps are small, so that areas can be told
/// apart in grey too.
struct PlotFill {
  const char* color;  ///< #rrggbb
  Hatch hatch;
};

/// The first five differ the most.
inline constexpr std::array<PlotFill, 8> plot_fills{{{"#123a5c", Hatch::none},
                                                     {"#b3400f", Hatch::falling},
                                                     {"#5b9bd0", Hatch::rising},
                                                     {"#f0b445", Hatch::dots},
                                                     {"#eef1f4", Hatch::none},
                                                     {"#1d232a", Hatch::level},
                                                     {"#3f8f5f", Hatch::level},
                                                     {"#f7d9a8", Hatch::rising}}};

/// The place among them of the fill of a state.
std::size_t fill_of(UnitState state);

/// Lightness of a colour, L* of CIELAB: what is left of it in grey. From 0, black, to 100.
double lightness(const std::string& color);

/// <defs> that fill_text() refers to. `id` is of the plot, unique in the page.
std::string fill_definitions(const std::string& id);
/// For `fill=`.
std::string fill_text(const std::string& id, std::size_t fill);

}  // namespace vrpipe::tools
