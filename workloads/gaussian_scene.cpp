#include <vrpipe/workloads/gaussian_scene.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <utility>

#include <vrpipe/component/error.h>

#include "file_io.h"
#include "ply_header.h"

namespace vrpipe {
namespace {

constexpr char kCannotRead[] = "cannot read scene";
constexpr char kExportRemedy[] = "export the scene as an INRIA 3D Gaussian splatting .ply (binary, little-endian)";

/// Offsets inside a record that we write: x y z nx ny nz f_dc f_rest opacity scale rot.
GaussianLayout canonical_layout(int sh_degree) {
  GaussianLayout layout;
  std::uint32_t offset = 0;
  const auto next = [&offset] {
    const std::uint32_t here = offset;
    offset += 4;
    return here;
  };
  for (auto& o : layout.position) o = next();
  offset += 12;  // normals
  for (auto& o : layout.f_dc) o = next();
  const std::size_t rest = 3 * std::size_t{kShRestPerChannel[static_cast<std::size_t>(sh_degree)]};
  for (std::size_t i = 0; i < rest; ++i) layout.f_rest[i] = next();
  layout.opacity = next();
  for (auto& o : layout.log_scale) o = next();
  for (auto& o : layout.rotation) o = next();
  return layout;
}

std::size_t canonical_floats(int sh_degree) {
  return 17 + 3 * std::size_t{kShRestPerChannel[static_cast<std::size_t>(sh_degree)]};
}

/// Finds the properties of the vertex element by name.
class VertexProperties {
 public:
  VertexProperties(const std::string& where, const PlyElement& vertex) : where_(where) {
    for (const PlyProperty& property : vertex.properties) {
      if (!by_name_.emplace(property.name, &property).second) {
        throw UserError(kCannotRead, where,
                        "property `" + shortened(property.name) + "` occurs twice in element vertex", kExportRemedy);
      }
    }
  }

  bool has(const std::string& name) const { return by_name_.count(name) != 0; }

  std::uint32_t offset_of_float(const std::string& name) const {
    const auto found = by_name_.find(name);
    if (found == by_name_.end()) {
      throw UserError(kCannotRead, where_, "element vertex has no property `" + name + "`",
                      has("packed_position") ? "this is a compressed .ply: convert it to an INRIA .ply"
                                             : kExportRemedy);
    }
    const PlyProperty& property = *found->second;
    if (property.type != "float" && property.type != "float32") {
      throw UserError(kCannotRead, where_, "property `" + name + "` has type `" + shortened(property.type) + "`",
                      "convert it to float");
    }
    return static_cast<std::uint32_t>(property.offset);
  }

  /// How many properties are named f_rest_N.
  std::size_t rest_count() const {
    std::size_t count = 0;
    for (const auto& entry : by_name_) count += entry.first.rfind("f_rest_", 0) == 0;
    return count;
  }

 private:
  std::string where_;
  std::unordered_map<std::string, const PlyProperty*> by_name_;
};

/// `count` records of `stride` bytes from `offset` must lie within the file's `available` bytes; returns their end.
std::uint64_t checked_end(const std::string& where, const PlyElement& element, std::uint64_t offset,
                          std::uint64_t available) {
  const std::uint64_t room = available - offset;
  if (element.stride_bytes == 0 || element.count <= room / element.stride_bytes) {
    return offset + element.count * element.stride_bytes;
  }
  const std::uint64_t most = std::numeric_limits<std::uint64_t>::max() - offset;
  const std::string expected = element.count <= most / element.stride_bytes
                                   ? std::to_string(offset + element.count * element.stride_bytes)
                                   : "more than 2^64";
  throw UserError(kCannotRead, where,
                  "the header announces " + std::to_string(element.count) + " records of " +
                      std::to_string(element.stride_bytes) + " bytes in element " + shortened(element.name) +
                      ", which needs " + expected + " bytes, and the file has " + std::to_string(available),
                  "get the file again, it seems cut short");
}

std::shared_ptr<const std::byte[]> read_records(const InputFile& file, const std::string& where, std::uint64_t offset,
                                                std::uint64_t size_bytes) {
  std::shared_ptr<std::byte[]> records;
  try {
    records.reset(new std::byte[static_cast<std::size_t>(size_bytes)]);  // not zeroed, as a vector would be
  } catch (const std::bad_alloc&) {
    throw UserError(kCannotRead, where, "its Gaussians need " + std::to_string(size_bytes >> 20U) + " MiB of memory",
                    "raise the limit on memory, or use a smaller scene");
  }
  file.read(offset, records.get(), static_cast<std::size_t>(size_bytes));
  return records;
}

}  // namespace

GaussianScene::GaussianScene(std::shared_ptr<const void> storage, const std::byte* records, std::uint64_t count,
                             std::size_t stride_bytes, const GaussianLayout& layout, int sh_degree)
    : storage_(std::move(storage)),
      records_(records),
      count_(count),
      stride_bytes_(stride_bytes),
      layout_(std::make_shared<const GaussianLayout>(layout)),
      sh_degree_(sh_degree) {}

GaussianSceneBuilder::GaussianSceneBuilder(int sh_degree) : sh_degree_(sh_degree), floats_per_gaussian_(0) {
  if (sh_degree < 0 || sh_degree > 3) throw std::invalid_argument("SH degree must be 0 to 3");
  floats_per_gaussian_ = canonical_floats(sh_degree);
}

void GaussianSceneBuilder::reserve(std::size_t gaussians) { floats_.reserve(gaussians * floats_per_gaussian_); }

void GaussianSceneBuilder::add(const GaussianAttributes& gaussian) {
  const auto append = [this](const float* values, std::size_t count) {
    floats_.insert(floats_.end(), values, values + count);
  };
  constexpr float kNoNormal[3] = {0, 0, 0};
  append(gaussian.position.data(), 3);
  append(kNoNormal, 3);
  append(gaussian.f_dc.data(), 3);
  for (const auto& channel : gaussian.f_rest) {
    append(channel.data(), kShRestPerChannel[static_cast<std::size_t>(sh_degree_)]);
  }
  append(&gaussian.opacity_logit, 1);
  append(gaussian.log_scale.data(), 3);
  append(gaussian.rotation.data(), 4);
}

GaussianScene GaussianSceneBuilder::build() {
  const std::uint64_t count = size();
  auto storage = std::make_shared<const std::vector<float>>(std::move(floats_));
  floats_.clear();
  const auto* records = reinterpret_cast<const std::byte*>(storage->data());
  return GaussianScene(storage, records, count, floats_per_gaussian_ * sizeof(float), canonical_layout(sh_degree_),
                       sh_degree_);
}

GaussianScene open_gaussian_ply(const std::filesystem::path& path) {
  const std::string where = path.string();
  const InputFile file(path, kCannotRead);
  const PlyHeader header = read_ply_header(file, kCannotRead, where, kExportRemedy);
  if (header.format != "binary_little_endian 1.0") {
    throw UserError(kCannotRead, where, "its format is `" + header.format + "`",
                    "convert it to `binary_little_endian 1.0`, the only one that is read");
  }

  std::uint64_t offset = header.size_bytes;
  const PlyElement* vertex = nullptr;
  for (const PlyElement& element : header.elements) {
    if (element.name == "vertex") {
      vertex = &element;
      break;
    }
    if (const PlyProperty* list = element.first_list()) {
      throw UserError(kCannotRead, where,
                      "element " + shortened(element.name) + " before element vertex has the list property `" +
                          shortened(list->name) + "`",
                      "write element vertex first");
    }
    offset = checked_end(where, element, offset, file.size());
  }
  if (vertex == nullptr) throw UserError(kCannotRead, where, "the header has no element vertex", kExportRemedy);
  if (const PlyProperty* list = vertex->first_list()) {
    throw UserError(kCannotRead, where, "element vertex has the list property `" + shortened(list->name) + "`",
                    "a Gaussian has scalar properties only; remove the list");
  }

  const VertexProperties properties(where, *vertex);
  GaussianLayout layout;
  constexpr const char* kAxes[] = {"x", "y", "z"};
  for (std::size_t i = 0; i < 3; ++i) layout.position[i] = properties.offset_of_float(kAxes[i]);
  for (std::size_t i = 0; i < 3; ++i) layout.f_dc[i] = properties.offset_of_float("f_dc_" + std::to_string(i));
  layout.opacity = properties.offset_of_float("opacity");
  for (std::size_t i = 0; i < 3; ++i) layout.log_scale[i] = properties.offset_of_float("scale_" + std::to_string(i));
  for (std::size_t i = 0; i < 4; ++i) layout.rotation[i] = properties.offset_of_float("rot_" + std::to_string(i));

  const std::size_t rest = properties.rest_count();
  int sh_degree = -1;
  for (std::size_t degree = 0; degree < kShRestPerChannel.size(); ++degree) {
    if (rest == 3 * std::size_t{kShRestPerChannel[degree]}) sh_degree = static_cast<int>(degree);
  }
  if (sh_degree < 0) {
    throw UserError(kCannotRead, where, "element vertex has " + std::to_string(rest) + " properties f_rest_*",
                    "SH degrees 0 to 3 have 0, 9, 24 or 45 of them");
  }
  for (std::size_t i = 0; i < rest; ++i) layout.f_rest[i] = properties.offset_of_float("f_rest_" + std::to_string(i));

  const std::uint64_t end = checked_end(where, *vertex, offset, file.size());
  std::shared_ptr<const std::byte[]> records = read_records(file, where, offset, end - offset);
  file.check_unchanged();
  const std::byte* const first = records.get();
  return GaussianScene(std::move(records), first, vertex->count, static_cast<std::size_t>(vertex->stride_bytes), layout,
                       sh_degree);
}

void write_gaussian_ply(const std::filesystem::path& path, const GaussianScene& scene) {
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
}

}  // namespace vrpipe
