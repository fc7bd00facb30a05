// Synthetic splats that were measured on the GPU.
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "measured/gpu.h"
#include "support/measured_scenes.h"

namespace vrpipe::measured {

namespace {

using testing::MeasuredScene;

/// Of tests/data/measured_scenes.csv, and how it is headed.
struct Column {
  const char* name;
  const char* heading;
  const char* mode = "";
};

constexpr Column counts[] = {{"triangles_clipped", "triangles"},
                             {"fragments", "fragments"},
                             {"fragments_blended", "blended"},
                             {"quads", "quads"},
                             {"quads_blended", "blended"},
                             {"warps", "warps"},
                             {"fragments_until_termination", "until ET"},
                             {"pixels_terminated", "px. ET"},
                             {"color_sectors", "sectors"}};
constexpr Column times[] = {{"rgba16f", "RGBA16F", "RGBA16F"},
                            {"rgba8", "RGBA8", "RGBA8"},
                            {"rgba32f", "RGBA32F", "RGBA32F"},
                            {"not_blended", "no blend", "not blended"},
                            {"stencil_all_pass", "pass", "stencil test, all pass"},
                            {"stencil_all_killed", "killed", "stencil test, all killed"},
                            {"pruned", "pruned", "pruned in the shader"},
                            {"vertices_only", "vertices", "vertices only"},
                            {"ideal_termination", "ideal ET", "ideal early termination"}};

using Values = std::map<std::string, double>;

/// Clipping leaves a triangle that may be seen: whose bounding box meets the image.
double triangles_in_view(const Draw& draw) {
  double seen = 0;
  for (const Splat& s : draw.splats) {
    for (const float side :
         {-1.0F, 1.0F}) {  // of the corners (0, 1, 2) and (1, 3, 2): two on the diagonal, and another
      const float x[] = {s.ax - s.bx, s.bx - s.ax, side * (s.ax + s.bx)};
      const float y[] = {s.ay - s.by, s.by - s.ay, side * (s.ay + s.by)};
      const auto meets = [](const float(&at)[3], float centre, std::uint32_t size) {
        return centre + std::fmax(at[0], std::fmax(at[1], at[2])) > 0 &&
               centre + std::fmin(at[0], std::fmin(at[1], at[2])) < static_cast<float>(size);
      };
      if (meets(x, s.cx, draw.width) && meets(y, s.cy, draw.height)) ++seen;
    }
  }
  return seen;
}

double pixels_terminated(const ColorSurface& surface) {
  double terminated = 0;
  for (std::uint32_t y = 0; y < surface.height(); ++y) {
    for (std::uint32_t x = 0; x < surface.width(); ++x) terminated += surface.pixel(x, y)[3] >= 0.996F ? 1 : 0;
  }
  return terminated;
}

double statistic(const RunResult& result, const std::string& name) {
  for (const StatisticReport& report : result.statistics) {
    if (report.name == name) return static_cast<double>(report.value);
  }
  return 0;
}

double color_sectors(const RunResult& result) {
  return (statistic(result, "crop.cache.bytes_filled") + statistic(result, "crop.cache.bytes_written_back")) / 32 +
         statistic(result, "crop.cache.sectors_fetched_again");
}

/// Everything that is compared.
Values predict(const Gpu& gpu, const Draw& draw) {
  Values values;
  for (const Column& time : times) {
    const RunResult result = gpu.run(draw, mode_named(time.mode));
    values[time.name] = Gpu::megacycles(result);
    if (time.name == std::string("rgba16f")) {
      const auto& count = result.counts;
      for (const auto& [name, value] : {std::pair{"fragments", count.fragments_shaded},
                                        {"fragments_blended", count.fragments_blended},
                                        {"quads", count.quads_shaded},
                                        {"quads_blended", count.quads_blended},
                                        {"warps", count.warps}}) {
        values[name] = static_cast<double>(value);
      }
      values["triangles_clipped"] = triangles_in_view(draw);
      values["pixels_terminated"] = pixels_terminated(result.framebuffer.color);
      values["color_sectors"] = color_sectors(result);
    }
    if (time.name == std::string("ideal_termination")) {
      values["fragments_until_termination"] = static_cast<double>(result.counts.fragments_shaded);
    }
  }
  return values;
}

void print_row(const std::string& scene, const char* what, const Values& values, const Column* begin, const Column* end,
               double unit, int digits) {
  std::printf("%-12s%-10s", scene.c_str(), what);
  for (const Column* column = begin; column != end; ++column) {
    const auto value = values.find(column->name);
    if (value == values.end()) {
      std::printf("%10s", "-");
    } else {
      std::printf("%10.*f", digits, value->second / unit);
    }
  }
  std::printf("\n");
}

void print_heading(const char* title, const Column* begin, const Column* end) {
  std::printf("%-22s", title);
  for (const Column* column = begin; column != end; ++column) std::printf("%10s", column->heading);
  std::printf("\n");
}

}  // namespace

void compare_scenes(const Gpu& gpu, bool is_short) {
  std::vector<std::pair<MeasuredScene, Values>> all;
  for (const std::string& name : testing::measured_scene_names()) {
    if (is_short && name != "sweep-50k") continue;
    MeasuredScene scene = testing::measured_scene(name);
    if (is_short) scene.draw.splats.resize(scene.draw.splats.size() / 20);
    const Values predicted = predict(gpu, scene.draw);
    all.emplace_back(std::move(scene), predicted);
  }
  print_heading("thousands", std::begin(counts), std::end(counts));
  for (const auto& [scene, predicted] : all) {
    print_row(scene.name, "measured", scene.values, std::begin(counts), std::end(counts), 1e3, 0);
    print_row("", "counted", predicted, std::begin(counts), std::end(counts), 1e3, 0);
  }
  std::printf("\n");
  print_heading("millions of cycles", std::begin(times), std::end(times));
  Values errors;
  double sum = 0;
  for (const auto& [scene, predicted] : all) {
    print_row(scene.name, "measured", scene.values, std::begin(times), std::end(times), 1, 3);
    print_row("", "predicted", predicted, std::begin(times), std::end(times), 1, 3);
    Values off;
    for (const Column& time : times) {
      off[time.name] = percent(predicted.at(time.name), scene.values.at(time.name));
      errors[time.name] += std::fabs(off[time.name]) / static_cast<double>(all.size());
      sum += std::fabs(off[time.name]);
    }
    print_row("", "%", off, std::begin(times), std::end(times), 1, 1);
  }
  print_row("mean of", "errors", errors, std::begin(times), std::end(times), 1, 1);
  std::printf("%-22s%10.1f\n", "over all modes", sum / static_cast<double>(all.size() * std::size(times)));
}

void compare_uniform(const Gpu& gpu, bool is_short) {
  std::printf("%-16s", "cycles a splat");
  std::vector<Column> columns;
  for (const Column& time : times) {
    if (time.name != std::string("rgba32f") && time.name != std::string("ideal_termination")) columns.push_back(time);
  }
  for (const Column& column : columns) std::printf("%17s", column.heading);
  std::printf("\n");
  Values errors;
  double scenes = 0;
  for (MeasuredScene& scene : testing::measured_uniform_scenes()) {
    if (is_short && scene.name != "4x4") continue;
    const double splats = static_cast<double>(scene.draw.splats.size());
    if (is_short) scene.draw.splats.resize(scene.draw.splats.size() / 20);
    std::printf("%-8s%8.2f", scene.name.c_str(), scene.values.at("opacity"));
    for (const Column& column : columns) {
      const double measured = scene.values.at(column.name);
      const double predicted = 1e6 * gpu.cycles(scene.draw, mode_named(column.mode)) / splats;
      std::printf("%10.1f%+7.1f", measured, percent(predicted, measured));
      std::fflush(stdout);
      errors[column.name] += std::fabs(percent(predicted, measured));
    }
    std::printf("\n");
    ++scenes;
  }
  std::printf("%-16s", "mean of errors");
  for (const Column& column : columns) std::printf("%17.1f", errors[column.name] / scenes);
  std::printf("\n");
}

}  // namespace vrpipe::measured
