// The .ply that INRIA's training code writes, and most programs export: float32 properties found by name, log scales, logit
// opacities, f_rest channel by channel. The vertices stay in memory as they lie in the file.
#include <string>
#include <vector>

#include "file_io.h"
#include "formats/ply_records.h"
#include "formats/scene_format.h"

namespace vrpipe {
namespace {

Match matches_inria_ply(const SceneFile& file) {
  if (file.bytes.begins_with("ply\n") || file.bytes.begins_with("ply\r\n")) return Match::by_container;
  return file.ends_with(".ply") ? Match::by_name : Match::no;
}

/// Nerfstudio's exports say which axis points up.
Vec3 up_of(const PlyHeader& header) {
  for (const std::string& comment : header.comments) {
    if (comment == "Vertical Axis: z") return {0, 0, 1};
    if (comment == "Vertical Axis: y") return {0, 1, 0};
    if (comment == "Vertical Axis: x") return {1, 0, 0};
  }
  return {0, -1, 0};
}

GaussianFile read_inria_ply(const SceneFile& file) {
  const PlyHeader header = read_gaussian_ply_header(file.bytes);
  const PlyRecords vertices(file.bytes, header, "vertex");
  GaussianLayout layout;
  const auto offset = [&](const std::string& name) { return vertices.offset(name, "float"); };
  constexpr const char* kAxes[] = {"x", "y", "z"};
  for (std::size_t i = 0; i < 3; ++i) layout.position[i] = offset(kAxes[i]);
  for (std::size_t i = 0; i < 3; ++i) layout.f_dc[i] = offset("f_dc_" + std::to_string(i));
  layout.opacity = offset("opacity");
  for (std::size_t i = 0; i < 3; ++i) layout.log_scale[i] = offset("scale_" + std::to_string(i));
  for (std::size_t i = 0; i < 4; ++i) layout.rotation[i] = offset("rot_" + std::to_string(i));
  const std::uint64_t rest = vertices.rest_count();
  const int sh_degree = sh_degree_of_ply(rest, "vertex", file.bytes);
  for (std::size_t i = 0; i < rest; ++i) layout.f_rest[i] = offset("f_rest_" + std::to_string(i));

  GaussianFile result;
  result.gaussians = GaussianScene(file.bytes.storage(), vertices.data(), vertices.count(),
                                   static_cast<std::size_t>(vertices.stride()), layout, sh_degree);
  result.up = up_of(header);
  return result;
}

std::vector<std::string> write_inria_ply(const std::filesystem::path& path, const GaussianScene& scene) {
  const std::size_t per_channel = kShRestPerChannel[static_cast<std::size_t>(scene.sh_degree())];
  std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(scene.size()) + "\n";
  const auto property = [&header](const std::string& name) { header += "property float " + name + "\n"; };
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) property(name);
  for (int i = 0; i < 3; ++i) property("f_dc_" + std::to_string(i));
  for (std::size_t i = 0; i < 3 * per_channel; ++i) property("f_rest_" + std::to_string(i));
  property("opacity");
  for (int i = 0; i < 3; ++i) property("scale_" + std::to_string(i));
  for (int i = 0; i < 4; ++i) property("rot_" + std::to_string(i));
  header += "end_header\n";

  AtomicFile file(path, "cannot write scene", path.string());
  file.write(header.data(), header.size());
  std::vector<float> record;
  for (std::uint64_t index = 0; index < scene.size(); ++index) {
    const GaussianRef gaussian = scene[index];
    record.clear();
    const auto append = [&record](const auto& values) { record.insert(record.end(), values.begin(), values.end()); };
    append(gaussian.position());
    append(std::array<float, 3>{0, 0, 0});
    append(gaussian.f_dc());
    for (std::uint32_t channel = 0; channel < 3; ++channel) {
      for (std::uint32_t c = 1; c <= per_channel; ++c) record.push_back(gaussian.f_rest(channel, c));
    }
    record.push_back(gaussian.opacity_logit());
    append(gaussian.log_scale());
    append(gaussian.rotation());
    file.write(record.data(), record.size() * sizeof(float));
  }
  file.commit();
  return {};
}

const SceneFormatRegistrar inria_ply_registrar(
    {"INRIA .ply",
     "FILE.ply",
     "what INRIA's training code and most other programs write: float32, SH degree 0 to 3",
     {},
     matches_inria_ply,
     read_inria_ply,
     write_inria_ply,
     ".ply"});

}  // namespace
}  // namespace vrpipe
