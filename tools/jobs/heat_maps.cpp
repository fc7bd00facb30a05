#include "jobs/heat_maps.h"

#include <algorithm>
#include <cstddef>

#include <nlohmann/json.hpp>

#include <vrpipe/pipeline/payload.h>

#include "host/output_file.h"
#include "image/color_scale.h"

namespace vrpipe::tools {
namespace {

constexpr const char* merged_name = "merged";
constexpr const char* fate_names[fragment_fates] = {"rasterized", "terminated", merged_name, "blended"};
constexpr const char* cycle_name = "termination_cycle";

std::vector<std::string> names_of(bool timed) {
  std::vector<std::string> names(std::begin(fate_names), std::end(fate_names));
  if (timed) names.emplace_back(cycle_name);
  return names;
}

/// Calls `see(index of a pixel)` for the lanes of a quad.
template <class See>
void for_each_pixel(TileId tile, unsigned position, LaneMask lanes, std::uint32_t width, const See& see) {
  const std::size_t x = tile.x * screen_tile_pixels + 2U * (position % quads_per_tile_row);
  const std::size_t y = tile.y * screen_tile_pixels + 2U * (position / quads_per_tile_row);
  for (unsigned lane = 0; lane < 4; ++lane) {
    if ((lanes >> lane & 1U) != 0) see((y + lane / 2) * width + x + lane % 2);
  }
}

std::uint32_t tiles_along(std::uint32_t pixels) { return (pixels + screen_tile_pixels - 1) / screen_tile_pixels; }

/// @param scale  pixels of the picture along a side of a value; the picture has this size
std::string picture(const NamedChannel& channel, std::uint32_t columns, unsigned scale, std::uint32_t width,
                    std::uint32_t height) {
  const float largest = *std::max_element(channel.values.begin(), channel.values.end());
  std::vector<std::uint8_t> rgb;
  rgb.reserve(std::size_t{3} * width * height);
  for (std::size_t y = 0; y < height; ++y) {
    for (std::size_t x = 0; x < width; ++x) {
      const float value = channel.values[y / scale * columns + x / scale];
      const std::array<std::uint8_t, 3> color = value > 0
                                                    ? viridis(static_cast<double>(value) / static_cast<double>(largest))
                                                    : std::array<std::uint8_t, 3>{};
      rgb.insert(rgb.end(), color.begin(), color.end());
    }
  }
  return encode_png(width, height, rgb);
}

std::string png_name(const std::string& stem, const std::string& of, const std::string& name) {
  return stem + "-" + of + "-" + name + ".png";
}
std::string exr_name(const std::string& stem, const std::string& of) { return stem + "-" + of + ".exr"; }
std::string legend_name(const std::string& stem) { return stem + "-heat-maps.json"; }

constexpr const char* pixels_name = "pixels";
constexpr const char* tiles_name = "tiles";

/// What the colours of pictures stand for.
nlohmann::ordered_json legend(const std::vector<NamedChannel>& channels) {
  nlohmann::ordered_json maps = nlohmann::ordered_json::object();
  for (const NamedChannel& channel : channels) {
    double sum = 0;
    for (const float value : channel.values) sum += static_cast<double>(value);
    const bool is_cycle = channel.name == cycle_name;
    maps[channel.name] = {{"unit", is_cycle ? "cycles" : "fragments"},
                          {"black", 0},
                          {"brightest", *std::max_element(channel.values.begin(), channel.values.end())},
                          {"sum", is_cycle ? nlohmann::ordered_json() : nlohmann::ordered_json(sum)}};
  }
  return maps;
}

}  // namespace

HeatMaps::HeatMaps(std::uint32_t width, std::uint32_t height, const RunRequest& request)
    : drawn_by_(request.variant.drawn_by),
      has_time_(has_course(request) && request.variant.is_of_pipeline()),
      fates_(width, height),
      cycles_(width, height) {}

void HeatMaps::attach(Observers& observers, bool terminates) {
  observers.on_fragments([this](const Observers::Fragments& seen) {
    float* const values = fates_.values() + static_cast<std::size_t>(seen.fate);
    for_each_pixel(seen.tile, seen.position, seen.lanes, fates_.width(),
                   [&](std::size_t pixel) { values[4 * pixel] += 1; });
  });
  if (!has_time_ || !terminates) return;
  observers.on_link<TerminationBeat>("crop.terminations", [this](const Observers::Passed<TerminationBeat>& passed) {
    for (unsigned i = 0; i < passed.item.count; ++i) {
      const TerminationSignal& signal = passed.item.signals[i];
      for_each_pixel(signal.tile, signal.position, signal.pixels, cycles_.width(), [&](std::size_t pixel) {
        float& cycle = cycles_.values()[4 * pixel];
        if (cycle == 0) cycle = static_cast<float>(passed.first);
      });
    }
  });
}

std::vector<NamedChannel> HeatMaps::of_pixels() const {
  const std::size_t pixels = std::size_t{fates_.width()} * fates_.height();
  std::vector<NamedChannel> channels;
  if (drawn_by_ == DrawnBy::accelerator) return channels;
  for (unsigned fate = 0; fate < fragment_fates; ++fate) {
    if (drawn_by_ == DrawnBy::software && static_cast<FragmentFate>(fate) == FragmentFate::merged) continue;
    NamedChannel& channel = channels.emplace_back(NamedChannel{fate_names[fate], std::vector<float>(pixels)});
    for (std::size_t i = 0; i < pixels; ++i) channel.values[i] = fates_.values()[4 * i + fate];
  }
  if (!has_time_) return channels;
  NamedChannel& channel = channels.emplace_back(NamedChannel{cycle_name, std::vector<float>(pixels)});
  for (std::size_t i = 0; i < pixels; ++i) channel.values[i] = cycles_.values()[4 * i];
  return channels;
}

std::vector<NamedChannel> HeatMaps::of_tiles(const std::vector<NamedChannel>& pixels) const {
  const std::uint32_t width = fates_.width(), height = fates_.height(), columns = tiles_along(width);
  std::vector<NamedChannel> channels;
  for (const NamedChannel& of_pixels : pixels) {
    std::vector<double> sums(std::size_t{columns} * tiles_along(height));
    std::vector<float> latest(sums.size());
    std::vector<bool> is_open(sums.size());
    for (std::size_t y = 0; y < height; ++y) {
      for (std::size_t x = 0; x < width; ++x) {
        const std::size_t tile = y / screen_tile_pixels * columns + x / screen_tile_pixels;
        const float value = of_pixels.values[y * width + x];
        sums[tile] += static_cast<double>(value);
        latest[tile] = std::max(latest[tile], value);
        is_open[tile] = is_open[tile] || value == 0;
      }
    }
    NamedChannel& channel = channels.emplace_back(NamedChannel{of_pixels.name, std::move(latest)});
    const bool is_cycle = of_pixels.name == cycle_name;
    for (std::size_t tile = 0; tile < sums.size(); ++tile) {
      if (!is_cycle) channel.values[tile] = static_cast<float>(sums[tile]);
      if (is_cycle && is_open[tile]) channel.values[tile] = 0;
    }
  }
  return channels;
}

std::vector<std::filesystem::path> HeatMaps::files(const std::string& stem, Fidelity fidelity) {
  std::vector<std::filesystem::path> files{legend_name(stem)};
  for (const char* of : {pixels_name, tiles_name}) {
    files.emplace_back(exr_name(stem, of));
    for (const std::string& name : names_of(has_time(fidelity))) files.emplace_back(png_name(stem, of, name));
  }
  return files;
}

void HeatMaps::write(const std::string& stem, ResultFiles& files) const {
  const std::uint32_t width = fates_.width(), height = fates_.height();
  const std::vector<NamedChannel> pixels = of_pixels();
  const std::vector<NamedChannel> tiles = of_tiles(pixels);
  const nlohmann::ordered_json legends{{pixels_name, legend(pixels)}, {tiles_name, legend(tiles)}};
  files.write(legend_name(stem), legends.dump(2) + "\n", option);
  files.write(exr_name(stem, pixels_name), encode_exr(width, height, pixels), option);
  files.write(exr_name(stem, tiles_name), encode_exr(tiles_along(width), tiles_along(height), tiles), option);
  for (const NamedChannel& channel : pixels) {
    files.write(png_name(stem, pixels_name, channel.name), picture(channel, width, 1, width, height), option);
  }
  for (const NamedChannel& channel : tiles) {
    files.write(png_name(stem, tiles_name, channel.name),
                picture(channel, tiles_along(width), screen_tile_pixels, width, height), option);
  }
}

}  // namespace vrpipe::tools
