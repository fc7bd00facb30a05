#include "jobs/heat_map.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include <nlohmann/json.hpp>

#include <vrpipe/pipeline/payload.h>

#include "image/base64.h"
#include "image/picture.h"

namespace vrpipe::tools {

std::shared_ptr<Observers> FragmentCounter::observers() {
  auto observers = std::make_shared<Observers>();
  observers->on_link<ShadedWarpItem>("prop.color", [this](const Observers::Passed<ShadedWarpItem>& passed) {
    const ShadedWarp& warp = *passed.item.warp;
    if (warp.mark != Mark::none) return;
    float* const counts = counts_.values();
    for (unsigned i = 0; i < warp.count; ++i) {
      const std::size_t x = warp.tile.x * screen_tile_pixels + 2U * (warp.position[i] % quads_per_tile_row);
      const std::size_t y = warp.tile.y * screen_tile_pixels + 2U * (warp.position[i] / quads_per_tile_row);
      for (unsigned lane = 0; lane < 4; ++lane) {
        if ((warp.live[i] >> lane & 1U) == 0) continue;
        counts[(y + lane / 2) * counts_.width() + x + lane % 2] += 1;
      }
    }
  });
  return observers;
}

HeatMap FragmentCounter::map() const {
  HeatMap map;
  map.width = counts_.width();
  map.height = counts_.height();
  std::vector<std::uint32_t> counts(std::size_t{map.width} * map.height);
  for (std::size_t i = 0; i < counts.size(); ++i) {
    counts[i] = static_cast<std::uint32_t>(counts_.values()[i]);
    map.sum += counts[i];
    map.largest = std::max<std::uint64_t>(map.largest, counts[i]);
  }
  const Picture picture = count_map(map.width, map.height, counts, HeatMap::largest_width);
  map.png = encode_png(picture.width, picture.height, picture.rgb);
  return map;
}

nlohmann::json to_json(const HeatMap& map) {
  return {{"width", map.width},
          {"height", map.height},
          {"sum", map.sum},
          {"largest", map.largest},
          {"png", base64(map.png)}};
}

HeatMap heat_map_from_json(const nlohmann::json& json) {
  HeatMap map;
  json.at("width").get_to(map.width);
  json.at("height").get_to(map.height);
  json.at("sum").get_to(map.sum);
  json.at("largest").get_to(map.largest);
  map.png = bytes_of_base64(json.at("png").get_ref<const std::string&>());
  return map;
}

}  // namespace vrpipe::tools
