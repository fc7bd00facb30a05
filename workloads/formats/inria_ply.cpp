// The .ply that INRIA's training code writes, and most programs export: properties found by name, log scales, logit opacities,
// f_rest channel by channel. Vertices of float32 stay in memory as they lie in the file.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <vrpipe/workloads/portable_math.h>
#include <vrpipe/workloads/preprocess.h>

#include "file_io.h"
#include "formats/attribute_codes.h"
#include "formats/ply_comments.h"
#include "formats/ply_records.h"
#include "formats/scene_format.h"

namespace vrpipe {
namespace {

Match matches_inria_ply(const SceneFile& file) {
  if (file.bytes.begins_with("ply\n") || file.bytes.begins_with("ply\r\n")) return Match::by_container;
  return file.ends_with(".ply") ? Match::by_name : Match::no;
}

/// What only looks like Gaussians as they are drawn here.
void refuse_other_models(const PlyRecords& vertices, const FileBytes& file) {
  const auto refuse = [&](const char* what, const std::string& property, const char* remedy) {
    file.fail(std::string("its Gaussians are ") + what + " (property `" + property + "`)", remedy);
  };
  for (const char* moving : {"motion_0", "trbf_center", "trbf_scale"}) {
    if (vertices.has(moving)) refuse("a dynamic scene's, which move", moving, "export one moment of it");
  }
  for (const char* anchor : {"f_offset_0", "f_anchor_feat_0"}) {
    if (vertices.has(anchor))
      refuse("anchors of Scaffold-GS, from which a network makes Gaussians for each view", anchor,
             "export the Gaussians that it makes");
  }
  if (vertices.has("scale_1") && !vertices.has("scale_2"))
    refuse("surfels of 2D Gaussian splatting, which have two scales", "scale_1",
           "train or export it with 3D Gaussians: surfels are drawn by another rule");
}

/// Where the attributes of a vertex are.
struct Columns {
  std::array<PlyNumber, 3> position, colour, log_scale;
  std::array<PlyNumber, 4> rotation;
  PlyNumber opacity;
  std::vector<PlyNumber> rest;  ///< that are used
  bool has_f_dc = true;         ///< else `colour` is red, green and blue, 0 to 255 (nerfstudio's --ply-color-mode rgb)
  std::optional<PlyNumber> filter;

  bool any(const std::function<bool(PlyNumber::Type)>& is) const {
    bool found = is(opacity.type);
    const auto look = [&](const auto& numbers) {
      for (const PlyNumber& number : numbers) found = found || is(number.type);
    };
    look(position);
    look(colour);
    look(log_scale);
    look(rotation);
    look(rest);
    return found;
  }
};

Columns columns_of(const PlyRecords& vertices, int degree, int used_degree) {
  Columns columns;
  constexpr const char* kAxes[] = {"x", "y", "z"};
  constexpr const char* kColours[] = {"red", "green", "blue"};
  columns.has_f_dc = vertices.has("f_dc_0") || !vertices.has("red");
  for (std::size_t i = 0; i < 3; ++i) {
    columns.position[i] = vertices.number(kAxes[i]);
    columns.colour[i] = vertices.number(columns.has_f_dc ? "f_dc_" + std::to_string(i) : std::string(kColours[i]));
    columns.log_scale[i] = vertices.number("scale_" + std::to_string(i));
  }
  columns.opacity = vertices.number("opacity");
  for (std::size_t i = 0; i < 4; ++i) columns.rotation[i] = vertices.number("rot_" + std::to_string(i));
  const std::size_t in_file = static_cast<std::size_t>((degree + 1) * (degree + 1) - 1);
  const std::size_t used = kShRestPerChannel[static_cast<std::size_t>(used_degree)];
  for (std::size_t channel = 0; channel < 3; ++channel) {
    for (std::size_t c = 0; c < used; ++c)
      columns.rest.push_back(vertices.number("f_rest_" + std::to_string(channel * in_file + c)));
  }
  if (vertices.has("filter_3D")) columns.filter = vertices.number("filter_3D");
  return columns;
}

/// The vertices as they lie in the file.
GaussianScene as_they_lie(const PlyRecords& vertices, const Columns& columns, int degree) {
  GaussianLayout layout;
  for (std::size_t i = 0; i < 3; ++i) {
    layout.position[i] = columns.position[i].offset;
    layout.f_dc[i] = columns.colour[i].offset;
    layout.log_scale[i] = columns.log_scale[i].offset;
  }
  layout.opacity = columns.opacity.offset;
  for (std::size_t i = 0; i < 4; ++i) layout.rotation[i] = columns.rotation[i].offset;
  for (std::size_t i = 0; i < columns.rest.size(); ++i) layout.f_rest[i] = columns.rest[i].offset;
  return {vertices.storage(),
          vertices.data(),
          vertices.count(),
          static_cast<std::size_t>(vertices.stride()),
          layout,
          degree};
}

/// The middle of double positions, in whole units: from there single precision is as fine as it can be.
std::array<double, 3> middle_of(const PlyRecords& vertices, const Columns& columns) {
  std::array<double, 3> middle{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (std::uint64_t i = 0; i < vertices.count(); ++i) {
      const double at = columns.position[axis].of(vertices[i]);
      if (!std::isfinite(at)) continue;
      low = std::min(low, at);
      high = std::max(high, at);
    }
    const double half_way = std::round(0.5 * low + 0.5 * high);
    if (std::isfinite(half_way)) middle[axis] = half_way;
  }
  return middle;
}

/// Mip-Splatting's filter of a Gaussian, put into its scales and its opacity as its authors put it (get_scaling_n_opacity_with_3D_filter).
void fuse_filter(double filter, GaussianAttributes& gaussian) {
  double before = 1, after = 1;
  for (float& log_scale : gaussian.log_scale) {
    const double scale = portable_exp(static_cast<double>(log_scale));
    const double fused = scale * scale + filter * filter;
    before *= scale * scale;
    after *= fused;
    log_scale = static_cast<float>(0.5 * portable_log(fused));
  }
  if (!(after > 0)) return;
  gaussian.opacity_logit =
      logit_of_opacity(sigmoid(static_cast<double>(gaussian.opacity_logit)) * std::sqrt(before / after));
}

GaussianScene converted(const PlyRecords& vertices, const Columns& columns, int degree, const FileBytes& file) {
  const std::size_t per_channel = kShRestPerChannel[static_cast<std::size_t>(degree)];
  const bool is_double = columns.position[0].type == PlyNumber::Type::float64;
  const std::array<double, 3> origin = is_double ? middle_of(vertices, columns) : std::array<double, 3>{};
  GaussianScene scene =
      decode_gaussians(vertices.count(), degree, file.where(), [&](std::uint64_t index, GaussianAttributes& gaussian) {
        const std::byte* const vertex = vertices[index];
        const auto number = [&](const PlyNumber& of) { return static_cast<float>(of.of(vertex)); };
        for (std::size_t i = 0; i < 3; ++i) {
          gaussian.position[i] = static_cast<float>(columns.position[i].of(vertex) - origin[i]);
          gaussian.log_scale[i] = number(columns.log_scale[i]);
          gaussian.f_dc[i] =
              columns.has_f_dc ? number(columns.colour[i]) : f_dc_of_colour(columns.colour[i].of(vertex) / 255);
        }
        for (std::size_t i = 0; i < 4; ++i) gaussian.rotation[i] = number(columns.rotation[i]);
        gaussian.opacity_logit = number(columns.opacity);
        for (std::size_t i = 0; i < columns.rest.size(); ++i)
          gaussian.f_rest[i / per_channel][i % per_channel] = number(columns.rest[i]);
        if (columns.filter) fuse_filter(columns.filter->of(vertex), gaussian);
      });
  scene.set_origin(origin);
  return scene;
}

/// Opacities and scales that are there as they are drawn, not as logits and logarithms, draw a fog. Empty for none.
std::string activated_note(const GaussianScene& scene) {
  for (std::uint64_t i = 0; i < scene.size(); ++i) {
    const GaussianRef gaussian = scene[i];
    const float opacity = gaussian.opacity_logit();
    if (!(opacity >= 0 && opacity <= 1)) return {};
    for (const float scale : gaussian.log_scale()) {
      if (!(scale >= 0)) return {};
    }
  }
  if (scene.empty()) return {};
  return "all opacities lie between 0 and 1 and no scale is below 0, as if they were not logits and logarithms: they "
         "are taken "
         "as these, as INRIA's files have them";
}

/// Names what of a vertex is not drawn, but for what everybody writes: normals, which are 0, and colours beside f_dc. Empty for
/// none.
std::string unused_note(const PlyRecords& vertices) {
  constexpr std::array<const char*, 19> kKnown = {"x",       "y",       "z",     "opacity",  "scale_0",
                                                  "scale_1", "scale_2", "rot_0", "rot_1",    "rot_2",
                                                  "nx",      "ny",      "rot_3", "red",      "green",
                                                  "blue",    "nz",      "alpha", "filter_3D"};
  constexpr std::size_t kMost = 8, kLongest = 40;
  std::string names;
  std::size_t count = 0;
  for (const std::string& name : vertices.names()) {
    const bool is_known = std::find(kKnown.begin(), kKnown.end(), name) != kKnown.end() || name.rfind("f_", 0) == 0;
    if (is_known || ++count > kMost) continue;
    names += (names.empty() ? "" : ", ") + name.substr(0, kLongest);
  }
  if (count > kMost) names += fmt::format(" and {} more", count - kMost);
  return names.empty() ? names : "properties of its vertices are not used: " + names;
}

GaussianFile read_inria_ply(const SceneFile& file) {
  const PlyHeader header = read_gaussian_ply_header(file.bytes);
  const PlyRecords vertices(file.bytes, header, "vertex");
  refuse_other_models(vertices, file.bytes);
  const int degree = sh_degree_of_ply(vertices.rest_count(), "vertex", file.bytes), used_degree = std::min(degree, 3);
  const Columns columns = columns_of(vertices, degree, used_degree);

  GaussianFile result;
  const bool lies_so = columns.has_f_dc && !columns.filter &&
                       !columns.any([](PlyNumber::Type type) { return type != PlyNumber::Type::float32; });
  result.gaussians =
      lies_so ? as_they_lie(vertices, columns, used_degree) : converted(vertices, columns, used_degree, file.bytes);
  apply_ply_comments(header, result);
  if (degree > used_degree) result.notes.push_back("spherical harmonics of degree 4 are left out");
  if (columns.filter) result.notes.push_back("Mip-Splatting's 3D filter (filter_3D) is put into scales and opacities");
  if (std::string note = unused_note(vertices); !note.empty()) result.notes.push_back(std::move(note));
  if (std::string note = activated_note(result.gaussians); !note.empty()) result.notes.push_back(std::move(note));
  return result;
}

std::vector<std::string> write_inria_ply(const std::filesystem::path& path, const GaussianFile& of) {
  const GaussianScene& scene = of.gaussians;
  const std::size_t per_channel = kShRestPerChannel[static_cast<std::size_t>(scene.sh_degree())];
  std::string header = "ply\nformat binary_little_endian 1.0\n" + ply_comments_of(of) + "element vertex " +
                       std::to_string(scene.size()) + "\n";
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
    append(scene.world_position(gaussian));
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
     "what INRIA's training code and most other programs write: binary or ascii, SH degree 0 to 3",
     {},
     matches_inria_ply,
     read_inria_ply,
     write_inria_ply,
     ".ply"});

}  // namespace
}  // namespace vrpipe
