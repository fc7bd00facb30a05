#include "jobs/page_material.h"

#include <algorithm>

#include "for_each_chunk.h"
#include "image/color_scale.h"

namespace vrpipe::tools {
namespace {

/// Made smaller by a whole factor, to the mean of what is above 0.
Picture smaller_map(const std::vector<float>& values, std::uint32_t width, std::uint32_t height, double brightest) {
  const std::uint32_t factor =
      std::max(1U, (width + PageMaterial::largest_heat_width - 1) / PageMaterial::largest_heat_width);
  Picture picture;
  picture.width = (width + factor - 1) / factor;
  picture.height = (height + factor - 1) / factor;
  for (std::uint32_t top = 0; top < height; top += factor) {
    for (std::uint32_t left = 0; left < width; left += factor) {
      double sum = 0;
      unsigned count = 0;
      for (std::uint32_t y = top; y < std::min(height, top + factor); ++y) {
        for (std::uint32_t x = left; x < std::min(width, left + factor); ++x) {
          const float value = values[std::size_t{y} * width + x];
          if (value <= 0) continue;
          sum += static_cast<double>(value);
          ++count;
        }
      }
      const std::array<std::uint8_t, 3> color =
          count > 0 ? viridis(sum / count / brightest) : std::array<std::uint8_t, 3>{};
      picture.rgb.insert(picture.rgb.end(), color.begin(), color.end());
    }
  }
  return picture;
}

std::vector<HeatRow> heat_rows(const std::vector<std::unique_ptr<HeatMaps>>& heat, std::uint32_t width,
                               std::uint32_t height, unsigned threads) {
  std::vector<std::vector<NamedChannel>> of_run(heat.size());
  for_each_chunk(heat.size(), threads, [&](std::uint64_t run) { of_run[run] = heat[run]->of_pixels(); });
  std::vector<HeatRow> rows;
  if (of_run.empty()) return rows;
  const auto most =
      std::max_element(of_run.begin(), of_run.end(), [](const auto& a, const auto& b) { return a.size() < b.size(); });
  for (const NamedChannel& named : *most) {
    HeatRow& row = rows.emplace_back();
    row.name = named.name;
    std::vector<const std::vector<float>*> values;
    for (const std::vector<NamedChannel>& channels : of_run) {
      const auto channel = std::find_if(channels.begin(), channels.end(),
                                        [&](const NamedChannel& each) { return each.name == named.name; });
      values.push_back(channel == channels.end() ? nullptr : &channel->values);
      row.of_run.emplace_back();
      if (values.back() == nullptr) continue;
      HeatPicture& map = row.of_run.back().emplace();
      for (const float value : *values.back()) {
        map.sum += static_cast<double>(value);
        map.largest = std::max(map.largest, static_cast<double>(value));
      }
      row.brightest = std::max(row.brightest, map.largest);
    }
    for_each_chunk(heat.size(), threads, [&](std::uint64_t run) {
      if (values[run] != nullptr) row.of_run[run]->picture = smaller_map(*values[run], width, height, row.brightest);
    });
  }
  return rows;
}

}  // namespace

PageMaterial page_material(const std::vector<Simulated>& simulated, std::size_t baseline,
                           const std::array<float, 3>& background, const std::vector<std::unique_ptr<HeatMaps>>& heat,
                           unsigned threads) {
  PageMaterial material;
  material.pictures.resize(simulated.size());
  material.errors.resize(simulated.size());
  const ShownImage reference = shown(*simulated[baseline].image, background);
  for_each_chunk(simulated.size(), threads, [&](std::uint64_t i) {
    const ShownImage image = shown(*simulated[i].image, background);
    material.pictures[i] = picture_of(image, PageMaterial::largest_width);
    if (i != baseline) material.errors[i] = image_error(image, reference);
  });
  const SharedImage& image = *simulated[baseline].image;
  material.heat = heat_rows(heat, image.width(), image.height(), threads);
  return material;
}

}  // namespace vrpipe::tools
