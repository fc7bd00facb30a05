#include "formats/gltf_data.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <boost/archive/iterators/binary_from_base64.hpp>
#include <boost/archive/iterators/dataflow_exception.hpp>
#include <boost/archive/iterators/transform_width.hpp>

#include "formats/sog_scene.h"
#include "glb.h"

namespace vrpipe {
namespace {

/// A part of a file's bytes.
FileBytes part_of(const FileBytes& bytes, std::uint64_t offset, std::uint64_t size, const std::string& what) {
  const std::byte* const first = bytes.range(offset, size, what);
  return FileBytes(std::shared_ptr<const std::byte[]>(bytes.storage(), first), size, bytes.where());
}

std::string without_escapes(const std::string& uri) {
  std::string name;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const std::string digits = uri[i] == '%' ? uri.substr(i + 1, 2) : "";
    const bool is_escape =
        digits.size() == 2 && digits.find_first_not_of("0123456789abcdefABCDEF") == std::string::npos;
    name += is_escape ? static_cast<char>(std::stoi(digits, nullptr, 16)) : uri[i];
    if (is_escape) i += 2;
  }
  return name;
}

}  // namespace

bool is_glb(const FileBytes& file) { return file.begins_with(kGlbMagic); }

double AccessorNumbers::at(std::uint64_t index, std::size_t component) const {
  const std::byte* const element = first + index * stride;
  const auto scaled = [&](auto value) {
    const double most = static_cast<double>(std::numeric_limits<decltype(value)>::max());
    return normalized ? std::max(static_cast<double>(value) / most, -1.0) : static_cast<double>(value);
  };
  switch (type) {
    case 5120: return scaled(load<std::int8_t>(element + component));
    case 5121: return scaled(load<std::uint8_t>(element + component));
    case 5122: return scaled(load<std::int16_t>(element + 2 * component));
    case 5123: return scaled(load<std::uint16_t>(element + 2 * component));
    default: return static_cast<double>(load<float>(element + 4 * component));
  }
}

GltfData::GltfData(const SceneFile& file) : file_(file) {
  if (is_glb(file.bytes)) {
    read_chunks();
  } else {
    document_ = parse_scene_json(file.bytes);
  }
}

void GltfData::fail(const std::string& why, const std::string& remedy) const { file_.bytes.fail(why, remedy); }

const GltfData::Json& GltfData::array(const Json& value, const std::string& place) const {
  if (!value.is_array()) fail("`" + place + "` is not an array", kGltfRemedy);
  return value;
}

const GltfData::Json& GltfData::element(const char* kind, std::uint64_t index, const std::string& place) const {
  const Json& all = array(json_member(document_, kind, file_.bytes), kind);
  if (index >= all.size() || !all[index].is_object())
    fail(fmt::format("{} names {}[{}], of {}", place, kind, index, all.size()), kGltfRemedy);
  return all[index];
}

std::uint64_t GltfData::whole(const Json& object, const char* name, const std::string& place) const {
  return json_count(json_member(object, name, file_.bytes), place + "." + name, file_.bytes);
}

std::uint64_t GltfData::whole_or(const Json& object, const char* name, std::uint64_t otherwise,
                                 const std::string& place) const {
  return object.contains(name) ? whole(object, name, place) : otherwise;
}

std::vector<double> GltfData::doubles(const Json& node, const char* name, std::size_t length,
                                      const std::string& place) const {
  std::vector<double> values;
  for (const Json& value : array(node[name], place + "." + name)) {
    if (!value.is_number() || !std::isfinite(value.get<double>())) break;
    values.push_back(value.get<double>());
  }
  if (values.size() != length || node[name].size() != length)
    fail(fmt::format("{}.{} is not {} numbers", place, name, length), kGltfRemedy);
  return values;
}

void GltfData::read_chunks() {
  const FileBytes& bytes = file_.bytes;
  const auto start = bytes.number<GlbStart>(0, "its header");
  if (start.version != 2) bytes.fail_at(offsetof(GlbStart, version), "it is no .glb of version 2", kGltfRemedy);
  if (start.document.kind != GlbChunk::json)
    bytes.fail_at(offsetof(GlbStart, document.kind), "its first chunk is no JSON", kGltfRemedy);
  document_ = parse_scene_json(part_of(bytes, sizeof start, start.document.bytes, "its JSON"));
  const std::uint64_t next = start.next_chunk();
  if (next >= bytes.size()) return;
  const auto chunk = bytes.number<GlbChunk>(next, "its second chunk");
  if (chunk.kind != GlbChunk::binary) return;
  binary_ = part_of(bytes, next + sizeof chunk, chunk.bytes, "its binary chunk");
  bytes_read_ += chunk.bytes;
}

const FileBytes& GltfData::buffer(std::uint64_t index, const std::string& place) {
  const auto known = buffers_.find(index);
  if (known != buffers_.end()) return known->second;
  const Json& buffer = element("buffers", index, place);
  FileBytes bytes;
  if (!buffer.contains("uri")) {
    if (index != 0 || !binary_) fail(fmt::format("buffers[{}] has no bytes", index), kGltfRemedy);
    bytes = *binary_;
  } else {
    const std::string uri = json_text(buffer["uri"], "uri", file_.bytes);
    bytes = uri.rfind("data:", 0) == 0 ? from_data_uri(uri) : file_.neighbour(without_escapes(uri));
    bytes_read_ += bytes.size();
  }
  return buffers_.emplace(index, std::move(bytes)).first->second;
}

FileBytes GltfData::from_data_uri(const std::string& uri) const {
  namespace iterators = boost::archive::iterators;
  using Decoded = iterators::transform_width<iterators::binary_from_base64<const char*>, 8, 6>;
  const std::string mark = ";base64,";
  const std::size_t at = uri.find(mark);
  if (at == std::string::npos) fail("a buffer's data URI is not in base64", kGltfRemedy);
  const std::size_t from = at + mark.size(), end = uri.find_last_not_of('=') + 1;
  const std::uint64_t size = end > from ? (end - from) * 6 / 8 : 0;
  const std::shared_ptr<std::byte[]> bytes = allocate_bytes(size, file_.bytes.where());
  try {
    Decoded next(uri.data() + from);
    std::generate_n(bytes.get(), size, [&next] { return static_cast<std::byte>(*next++); });
  } catch (const iterators::dataflow_exception&) {
    fail("a buffer's data URI is not in base64", kGltfRemedy);
  }
  return FileBytes(bytes, size, file_.bytes.where() + ", a buffer");
}

AccessorNumbers GltfData::numbers(const Json& attributes, const std::string& name, std::uint64_t components,
                                  const std::string& place) {
  const std::string of = place + "." + name;
  if (!attributes.contains(name)) fail(place + " has no `" + name + "`", kGltfRemedy);
  const Json& accessor = element("accessors", json_count(attributes[name], of, file_.bytes), of);
  const char* const shape = components == 1 ? "SCALAR" : components == 3 ? "VEC3" : "VEC4";
  if (!accessor.contains("type") || accessor["type"] != shape) fail(of + " is not of type " + shape, kGltfRemedy);
  if (accessor.contains("sparse") || !accessor.contains("bufferView"))
    fail(of + " has a sparse accessor, or one without data", kGltfRemedy);
  AccessorNumbers result;
  result.type = whole(accessor, "componentType", of);
  const bool is_known = (result.type >= 5120 && result.type <= 5123) || result.type == 5126;
  if (!is_known) fail(of + " is of neither bytes, shorts nor floats", kGltfRemedy);
  result.normalized = accessor.contains("normalized") && accessor["normalized"] == true;
  result.count = whole(accessor, "count", of);
  const Json& view = element("bufferViews", whole(accessor, "bufferView", of), of);
  const std::uint64_t size = components * (result.type == 5126 ? 4 : result.type >= 5122 ? 2 : 1);
  result.stride = whole_or(view, "byteStride", size, of);
  if (result.stride < size || result.stride > 252) fail(of + " has a byteStride that cannot be", kGltfRemedy);
  result.bytes = part_of(buffer(whole(view, "buffer", of), of), whole_or(view, "byteOffset", 0, of),
                         whole(view, "byteLength", of), of);
  const std::uint64_t offset = whole_or(accessor, "byteOffset", 0, of);
  if (result.count > 0) {
    result.bytes.records(offset, result.count - 1, result.stride, of);
    result.bytes.range(offset + (result.count - 1) * result.stride, size, of);
  }
  result.first = result.bytes.data() + offset;
  return result;
}

}  // namespace vrpipe
