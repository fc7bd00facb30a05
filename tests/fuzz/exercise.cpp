#include "fuzz/exercise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/preprocess.h>

namespace vrpipe::testing {
namespace {

const SceneFormat& format_named(const std::string& name) {
  for (const SceneFormat& format : scene_formats()) {
    if (format.name == name) return format;
  }
  throw std::invalid_argument("no format " + name);
}

/// The files of a bundle, by name; the one that is read has an empty name. Other bytes are that file.
std::map<std::string, FileBytes> unbundled(const std::string& bytes) {
  std::map<std::string, FileBytes> files;
  const std::string mark = "==> ";
  if (bytes.compare(0, mark.size(), mark) != 0) {
    files[""] = FileBytes::copy(bytes.data(), bytes.size(), "fuzzed");
    return files;
  }
  std::size_t at = 0;
  while (at < bytes.size()) {
    const std::size_t end = std::min(bytes.find("\n" + mark, at), bytes.size());
    const std::size_t line = std::min(bytes.find('\n', at), end);
    const std::string name = bytes.substr(at + mark.size(), line - std::min(line, at + mark.size()));
    const std::size_t from = std::min(line + 1, end);
    const FileBytes file = FileBytes::copy(bytes.data() + from, end - from, "fuzzed/" + name.substr(0, 100));
    files.emplace(name, file);
    if (at == 0) files.emplace("", file);
    at = end + 1;
  }
  return files;
}

/// Of all Gaussians, but of very large scenes only the first ones and the last.
void look_at_all(const GaussianScene& scene) {
  constexpr std::uint64_t kMost = 4096;
  double sum = 0;
  for (std::uint64_t i = 0; i < scene.size(); ++i) {
    if (i == kMost) i = std::max(i, scene.size() - 1);
    const GaussianRef gaussian = scene[i];
    for (const float value : gaussian.position()) sum += value;
    for (const float value : gaussian.log_scale()) sum += value;
    for (const float value : gaussian.rotation()) sum += value;
    for (const float value : gaussian.f_dc()) sum += value;
    sum += gaussian.opacity_logit();
    for (std::uint32_t c = 1; c <= kShRestPerChannel[static_cast<std::size_t>(scene.sh_degree())]; ++c) {
      for (std::uint32_t channel = 0; channel < 3; ++channel) sum += gaussian.f_rest(channel, c);
    }
  }
  volatile double used = sum;
  static_cast<void>(used);
  if (scene.size() > kMost) return;
  Camera camera;
  camera.eye = {0, 0, -5};
  camera.fx = camera.fy = 32;
  camera.width = camera.height = 32;
  PreprocessOptions options;
  options.threads = 1;
  SceneSummary summary;
  for (const Splat& splat : preprocess(scene, camera, options, summary).splats) {
    const std::array<float, 10> values = {splat.cx, splat.cy, splat.ax,  splat.ay,    splat.bx,
                                          splat.by, splat.r,  splat.red, splat.green, splat.blue};
    if (!std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); })) {
      throw std::logic_error("a splat is not finite");
    }
  }
}

}  // namespace

SceneFile hostile_file(const std::string& format, const void* data, std::size_t size) {
  const std::string bytes(static_cast<const char*>(data), size);
  const unsigned last = size == 0 ? 0 : static_cast<unsigned char>(bytes.back());
  const auto files = std::make_shared<std::map<std::string, FileBytes>>(unbundled(bytes));
  SceneFile file;
  file.bytes = files->at("");
  file.neighbour = [files](const std::string& name) {
    const auto found = files->find(name);
    if (found == files->end()) throw UserError(kCannotReadScene, "fuzzed", "no such file", "check the path");
    return found->second;
  };
  if (format == "any") {
    constexpr std::array<const char*, 8> kNames = {"a.ply",    "a.compressed.ply", "a.splat",       "a.spz",
                                                   "a.ksplat", "meta.json",        "lod-meta.json", "a.gltf"};
    file.name = kNames[last % kNames.size()];
  } else if (format == "PlayCanvas streamed SOG" && last % 4 != 0) {
    file.choices["lod"] = std::to_string(last % 4);
  } else if (format == "Niantic .spz" && last % 2 != 0) {
    file.choices["axes"] = "rdf";
  }
  return file;
}

std::string exercise(const std::string& format, const void* data, std::size_t size) {
  std::string message;
  try {
    const SceneFile file = hostile_file(format, data, size);
    look_at_all((format == "any" ? read_scene(file) : format_named(format).read(file)).gaussians);
    return {};
  } catch (const UserError& error) {
    message = error.what();
  }
  constexpr std::size_t kLongest = 1000;  // what is not printable takes four times as much
  if (message.size() > kLongest) throw std::logic_error("a message of " + std::to_string(message.size()) + " bytes");
  for (const char c : message) {
    if (static_cast<unsigned char>(c) < ' ') throw std::logic_error("not one printable line: " + message);
  }
  return message;
}

}  // namespace vrpipe::testing
