#include "output/plot_fill.h"

#include <cmath>

#include <fmt/format.h>

namespace vrpipe::tools {
namespace {

const char* hatch_shape(Hatch hatch) {
  switch (hatch) {
    case Hatch::none: break;
    case Hatch::rising: return "<path d=\"M-1,1 l2,-2 M0,6 l6,-6 M5,7 l2,-2\" stroke=\"#fff\" stroke-width=\"1.2\"/>";
    case Hatch::falling: return "<path d=\"M-1,5 l2,2 M0,0 l6,6 M5,-1 l2,2\" stroke=\"#fff\" stroke-width=\"1\"/>";
    case Hatch::level: return "<path d=\"M0,3 h6\" stroke=\"#fff\" stroke-width=\"1\"/>";
    case Hatch::dots: return "<circle cx=\"3\" cy=\"3\" r=\"1\" fill=\"#6b4a10\"/>";
  }
  return "";
}

}  // namespace

std::size_t fill_of(UnitState state) {
  switch (state) {
    case UnitState::busy: return 0;
    case UnitState::memory: return 1;
    case UnitState::blocked: return 2;
    case UnitState::latency: return 3;
    case UnitState::starved: return 4;
  }
  return 4;
}

double lightness(const std::string& color) {
  const auto linear = [&](std::size_t place) {
    const double value = std::stoi(color.substr(place, 2), nullptr, 16) / 255.0;
    return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
  };
  const double luminance = 0.2126 * linear(1) + 0.7152 * linear(3) + 0.0722 * linear(5);
  return luminance > 0.008856 ? 116 * std::cbrt(luminance) - 16 : 903.3 * luminance;
}

std::string fill_definitions(const std::string& id) {
  std::string text = "<defs>\n";
  for (std::size_t i = 0; i < plot_fills.size(); ++i) {
    if (plot_fills[i].hatch == Hatch::none) continue;
    text += fmt::format(
        "<pattern id=\"{}-fill{}\" width=\"6\" height=\"6\" patternUnits=\"userSpaceOnUse\">"
        "<rect width=\"6\" height=\"6\" fill=\"{}\"/>{}</pattern>\n",
        id, i, plot_fills[i].color, hatch_shape(plot_fills[i].hatch));
  }
  return text + "</defs>\n";
}

std::string fill_text(const std::string& id, std::size_t fill) {
  const std::size_t place = fill % plot_fills.size();
  return plot_fills[place].hatch == Hatch::none ? plot_fills[place].color : fmt::format("url(#{}-fill{})", id, place);
}

}  // namespace vrpipe::tools
