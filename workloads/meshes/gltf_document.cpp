#include "gltf_document.h"

#include <cmath>
#include <cstring>
#include <optional>
#include <vector>

#include <nlohmann/json.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/mesh.h>

#include "../glb.h"

namespace vrpipe {
namespace {

using Json = nlohmann::json;

/// A document that is used has about ten levels, and deeper ones end recursive readers.
constexpr int kMaxNesting = 64;
constexpr std::size_t kMaxNodeDepth = 256;
constexpr std::uint64_t kMaxBytes = std::uint64_t{1} << 30;

/// Of bytes that are there.
template <class T>
T load(const std::string& bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

template <class T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Copies what is used of a document, piece by piece, each checked against those that were copied before.
class GltfReducer {
 public:
  GltfReducer(const Json& source, const std::string& where, std::optional<std::size_t> binary_bytes,
              std::vector<std::uint64_t>& triangles)
      : source_(source), where_(where), binary_bytes_(binary_bytes), triangles_(triangles) {}

  Json reduce() {
    if (!source_.is_object()) fail("it is no JSON object");
    const Json& asset = member(source_, "asset", "the document");
    const auto version = asset.is_object() ? asset.find("version") : asset.end();
    if (version == asset.end() || !version->is_string() || version->get<std::string>().substr(0, 2) != "2.") {
      fail("it is not of glTF version 2");
    }
    if (source_.contains("extensionsRequired")) {
      for (const Json& name : source_["extensionsRequired"]) {
        // Gaussians are no triangles, and left out as other points are.
        if (name == kGltfGaussians) continue;
        const std::string text = name.is_string() ? name.get<std::string>().substr(0, 100) : "without a name";
        fail("it requires the extension " + text + ", which is not supported");
      }
    }
    result_["asset"] = {{"version", "2.0"}};
    copy_all("buffers", &GltfReducer::buffer);
    copy_all("bufferViews", &GltfReducer::buffer_view);
    copy_all("accessors", &GltfReducer::accessor);
    copy_all("materials", &GltfReducer::material);
    copy_all("meshes", &GltfReducer::mesh);
    copy_all("nodes", &GltfReducer::node);
    check_tree();
    copy_all("scenes", &GltfReducer::scene);
    if (count("scenes") == 0) fail("it has no scene");
    result_["scene"] = source_.contains("scene") ? index(source_, "scene", "scenes", "the document") : 0;
    return std::move(result_);
  }

 private:
  [[noreturn]] void fail(const std::string& why) const {
    throw UserError("cannot read mesh", where_, why, "export it again, as plain glTF 2.0 triangles");
  }

  const Json& member(const Json& object, const char* name, const std::string& place) const {
    const auto found = object.find(name);
    if (found == object.end()) fail(place + " has no `" + name + "`");
    return *found;
  }

  std::uint64_t whole(const Json& value, const std::string& place) const {
    if (!value.is_number_unsigned()) fail(place + " is not a whole number of 0 or more");
    return value.get<std::uint64_t>();
  }
  std::uint64_t whole_or(const Json& object, const char* name, std::uint64_t otherwise,
                         const std::string& place) const {
    return object.contains(name) ? whole(object[name], place + "." + name) : otherwise;
  }

  /// How many of `kind` were copied.
  std::size_t count(const char* kind) const { return result_.contains(kind) ? result_[kind].size() : 0; }

  std::uint64_t index_of(const Json& value, const char* kind, const std::string& place) const {
    const std::uint64_t i = whole(value, place);
    if (i >= count(kind)) fail(place + " is " + std::to_string(i) + ", of " + std::to_string(count(kind)) + " " + kind);
    return i;
  }
  std::uint64_t index(const Json& object, const char* name, const char* kind, const std::string& place) const {
    return index_of(member(object, name, place), kind, place + "." + name);
  }

  void numbers(const Json& from, const char* name, std::size_t length, Json& to, const std::string& place) const {
    if (!from.contains(name)) return;
    const Json& values = from[name];
    if (!values.is_array() || values.size() != length) {
      fail(place + "." + name + " is not an array of " + std::to_string(length) + " numbers");
    }
    for (const Json& value : values) {
      if (!value.is_number() || !std::isfinite(value.get<double>()))
        fail(place + "." + name + " has no finite numbers");
    }
    to[name] = values;
  }

  void copy_all(const char* kind, Json (GltfReducer::*copy)(const Json&, const std::string&)) {
    if (!source_.contains(kind)) return;
    const Json& all = source_[kind];
    if (!all.is_array()) fail(std::string("`") + kind + "` is not an array");
    Json copies = Json::array();
    for (std::size_t i = 0; i < all.size(); ++i) {
      const std::string place = std::string(kind) + "[" + std::to_string(i) + "]";
      if (!all[i].is_object()) fail(place + " is not an object");
      copies.push_back((this->*copy)(all[i], place));
    }
    // Assimp does not take an empty array.
    if (!copies.empty()) result_[kind] = std::move(copies);
  }

  Json buffer(const Json& from, const std::string& place) {
    const std::uint64_t length = whole(member(from, "byteLength", place), place + ".byteLength");
    if (length == 0 || length > kMaxBytes) fail(place + " has " + std::to_string(length) + " bytes");
    Json to = {{"byteLength", length}};
    if (from.contains("uri")) {
      if (!from["uri"].is_string()) fail(place + ".uri is not a string");
      to["uri"] = from["uri"];
    } else if (!binary_bytes_ || place != "buffers[0]" || length > *binary_bytes_) {
      fail(place + " has more bytes than the file has for it");
    }
    return to;
  }

  Json buffer_view(const Json& from, const std::string& place) {
    const std::uint64_t buffer = index(from, "buffer", "buffers", place);
    const std::uint64_t offset = whole_or(from, "byteOffset", 0, place);
    const std::uint64_t length = whole(member(from, "byteLength", place), place + ".byteLength");
    const std::uint64_t stride = whole_or(from, "byteStride", 0, place);
    const std::uint64_t available = result_["buffers"][buffer]["byteLength"].get<std::uint64_t>();
    if (length == 0 || offset > available || length > available - offset) fail(place + " exceeds its buffer");
    if (stride != 0 && (stride < 4 || stride > 252)) fail(place + ".byteStride is not 4 to 252");
    Json to = {{"buffer", buffer}, {"byteOffset", offset}, {"byteLength", length}};
    if (stride != 0) to["byteStride"] = stride;
    return to;
  }

  Json accessor(const Json& from, const std::string& place) {
    const std::uint64_t type = whole(member(from, "componentType", place), place + ".componentType");
    const std::uint64_t bytes = type == 5120 || type == 5121 ? 1 : type == 5122 || type == 5123 ? 2 : 4;
    if (type < 5120 || type > 5126 || type == 5124) fail(place + ".componentType is none of glTF's");
    const Json& shape = member(from, "type", place);
    const std::uint64_t components = shape == "SCALAR"                    ? 1
                                     : shape == "VEC2"                    ? 2
                                     : shape == "VEC3"                    ? 3
                                     : shape == "VEC4" || shape == "MAT2" ? 4
                                     : shape == "MAT3"                    ? 9
                                     : shape == "MAT4"                    ? 16
                                                                          : 0;
    if (components == 0) fail(place + ".type is none of glTF's");
    const std::uint64_t elements = whole(member(from, "count", place), place + ".count");
    if (elements == 0 || elements > 3 * std::uint64_t{kMaxMeshElements}) {
      fail(place + " has " + std::to_string(elements) + " elements");
    }
    Json to = {{"componentType", type}, {"type", shape}, {"count", elements}};
    if (from.contains("normalized") && from["normalized"].is_boolean()) to["normalized"] = from["normalized"];
    // Of others, nothing is used; see primitive().
    if (from.contains("sparse") || !from.contains("bufferView")) return to;
    const std::uint64_t view = index(from, "bufferView", "bufferViews", place);
    const std::uint64_t offset = whole_or(from, "byteOffset", 0, place);
    const Json& viewed = result_["bufferViews"][view];
    const std::uint64_t size = bytes * components;
    const std::uint64_t stride = viewed.contains("byteStride") ? viewed["byteStride"].get<std::uint64_t>() : size;
    const std::uint64_t available = viewed["byteLength"].get<std::uint64_t>();
    if (stride < size || offset > available || size > available - offset ||
        (elements - 1) * stride > available - offset - size) {
      fail(place + " exceeds its bufferView");
    }
    to["bufferView"] = view;
    to["byteOffset"] = offset;
    return to;
  }

  Json material(const Json& from, const std::string& place) {
    Json to = Json::object();
    to["pbrMetallicRoughness"] = Json::object();
    const auto found = from.find("pbrMetallicRoughness");
    if (found == from.end() || !found->is_object()) return to;
    numbers(*found, "baseColorFactor", 4, to["pbrMetallicRoughness"], place + ".pbrMetallicRoughness");
    return to;
  }

  /// An accessor whose data are in a buffer.
  const Json& data_of(const Json& value, const std::string& place) const {
    const std::uint64_t i = index_of(value, "accessors", place);  // first: without accessors there is no such member
    const Json& accessor = result_["accessors"][i];
    if (!accessor.contains("bufferView")) fail(place + " has a sparse accessor, or one without data");
    return accessor;
  }

  Json primitive(const Json& from, const std::string& place) {
    if (!from.is_object()) fail(place + " is not an object");
    const Json& attributes = member(from, "attributes", place);
    if (!attributes.is_object()) fail(place + ".attributes is not an object");
    const std::uint64_t mode = whole_or(from, "mode", 4, place);
    if (mode > 6) fail(place + ".mode is none of glTF's");
    Json to = {{"mode", mode}, {"attributes", Json::object()}};
    member(attributes, "POSITION", place + ".attributes");
    std::uint64_t vertices = 0;
    for (const char* name : {"POSITION", "NORMAL", "COLOR_0"}) {
      if (!attributes.contains(name)) continue;
      const std::string attribute = place + ".attributes." + name;
      const Json& data = data_of(attributes[name], attribute);
      const bool colour = std::strcmp(name, "COLOR_0") == 0;
      const bool good = (data["type"] == "VEC3" || (colour && data["type"] == "VEC4")) &&
                        (data["componentType"] == 5126 ||
                         (colour && (data["componentType"] == 5121 || data["componentType"] == 5123)));
      if (!good) fail(attribute + " is not of a type that glTF allows");
      const auto elements = data["count"].get<std::uint64_t>();
      if (vertices == 0) vertices = elements;
      if (elements != vertices || elements > kMaxMeshElements) {
        fail(attribute + " has " + std::to_string(elements) + " elements, of " + std::to_string(vertices) +
             " vertices; at most " + std::to_string(kMaxMeshElements) + " are read");
      }
      to["attributes"][name] = attributes[name];
    }
    std::uint64_t corners = vertices;
    if (from.contains("indices")) {
      const Json& data = data_of(from["indices"], place + ".indices");
      const auto type = data["componentType"].get<std::uint64_t>();
      if (data["type"] != "SCALAR" || (type != 5121 && type != 5123 && type != 5125)) {
        fail(place + ".indices are not unsigned whole numbers");
      }
      corners = data["count"].get<std::uint64_t>();
      to["indices"] = from["indices"];
    }
    const std::uint64_t least = mode == 0 ? 1 : mode < 4 ? 2 : 3;
    if (corners < least) fail(place + " has " + std::to_string(corners) + " corners");
    if (mode == 4) triangles_.back() += corners / 3;
    if (mode > 4) triangles_.back() += corners - 2;
    if (from.contains("material")) to["material"] = index(from, "material", "materials", place);
    return to;
  }

  Json mesh(const Json& from, const std::string& place) {
    const Json& primitives = member(from, "primitives", place);
    if (!primitives.is_array() || primitives.empty()) fail(place + " has no primitives");
    Json to = {{"name", std::to_string(triangles_.size())}, {"primitives", Json::array()}};
    triangles_.push_back(0);
    for (std::size_t i = 0; i < primitives.size(); ++i) {
      to["primitives"].push_back(primitive(primitives[i], place + ".primitives[" + std::to_string(i) + "]"));
    }
    return to;
  }

  Json node(const Json& from, const std::string& place) {
    Json to = Json::object();
    if (from.contains("mesh")) to["mesh"] = index(from, "mesh", "meshes", place);
    numbers(from, "matrix", 16, to, place);
    numbers(from, "translation", 3, to, place);
    numbers(from, "rotation", 4, to, place);
    numbers(from, "scale", 3, to, place);
    if (from.contains("children")) to["children"] = node_list(from, "children", place);
    return to;
  }

  /// Nodes refer to each other, so that they are checked against the source.
  Json node_list(const Json& from, const char* name, const std::string& place) const {
    const Json& list = from[name];
    if (!list.is_array()) fail(place + "." + name + " is not an array");
    const std::size_t nodes = source_.contains("nodes") ? source_["nodes"].size() : 0;
    for (const Json& child : list) {
      if (whole(child, place + "." + name) >= nodes) fail(place + "." + name + " names a node that is not there");
    }
    return list;
  }

  /// Every node has one parent at most, and is not too far down.
  void check_tree() const {
    const std::size_t nodes = count("nodes");
    std::vector<std::size_t> parent(nodes, nodes);
    for (std::size_t i = 0; i < nodes; ++i) {
      const Json& from = result_["nodes"][i];
      if (!from.contains("children")) continue;
      for (const Json& child : from["children"]) {
        std::size_t& of_child = parent[child.get<std::size_t>()];
        if (of_child != nodes) fail("node " + std::to_string(child.get<std::size_t>()) + " has two parents");
        of_child = i;
      }
    }
    for (std::size_t i = 0; i < nodes; ++i) {
      std::size_t depth = 0;
      for (std::size_t at = i; parent[at] != nodes; at = parent[at]) {
        if (++depth > kMaxNodeDepth) {
          fail("its nodes go around in a circle, or more than " + std::to_string(kMaxNodeDepth) + " deep");
        }
      }
    }
  }

  Json scene(const Json& from, const std::string& place) {
    Json to = Json::object();
    to["nodes"] = from.contains("nodes") ? node_list(from, "nodes", place) : Json::array();
    return to;
  }

  const Json& source_;
  const std::string& where_;
  std::optional<std::size_t> binary_bytes_;  ///< of the binary chunk of a .glb
  std::vector<std::uint64_t>& triangles_;
  Json result_ = Json::object();
};

std::string reduced_json(const std::string& text, const std::string& where, std::optional<std::size_t> binary_bytes,
                         std::vector<std::uint64_t>& triangles) {
  bool too_deep = false;
  const auto watch = [&](int depth, Json::parse_event_t, Json&) {
    too_deep = too_deep || depth > kMaxNesting;
    return !too_deep;
  };
  const Json source = Json::parse(text, watch, /*allow_exceptions=*/false);
  const char* why = too_deep ? "its JSON is nested too deep" : source.is_discarded() ? "it is not valid JSON" : nullptr;
  if (why != nullptr) throw UserError("cannot read mesh", where, why, "export it again, as glTF 2.0");
  return GltfReducer(source, where, binary_bytes, triangles).reduce().dump();
}

}  // namespace

std::string reduced_gltf(const std::string& bytes, const std::string& where, std::vector<std::uint64_t>& triangles) {
  if (!begins_as_gltf(bytes)) {
    throw UserError("cannot read mesh", where, kNoGltf, "get the file again, or name it by its format");
  }
  if (bytes.compare(0, 4, kGlbMagic) != 0) return reduced_json(bytes, where, {}, triangles);
  const auto cut_short = [&] {
    return UserError("cannot read mesh", where, "it is cut short, or no .glb of version 2", "get the file again");
  };
  if (bytes.size() < sizeof(GlbStart)) throw cut_short();
  auto start = load<GlbStart>(bytes, 0);
  if (start.version != 2 || start.bytes != bytes.size() || start.document.kind != GlbChunk::json ||
      start.document.bytes > bytes.size() - sizeof start) {
    throw cut_short();
  }
  const std::size_t next = start.next_chunk();
  GlbChunk chunk{0, GlbChunk::binary};
  std::string binary;
  if (next + sizeof chunk <= bytes.size()) {
    chunk = load<GlbChunk>(bytes, next);
    if (chunk.kind != GlbChunk::binary || chunk.bytes > bytes.size() - next - sizeof chunk) throw cut_short();
    binary = bytes.substr(next + sizeof chunk, chunk.bytes);
  }
  std::string text = reduced_json(bytes.substr(sizeof start, start.document.bytes), where, binary.size(), triangles);
  text.resize((text.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4, '\0');
  start.document.bytes = static_cast<std::uint32_t>(text.size());
  chunk.bytes = static_cast<std::uint32_t>(binary.size());
  start.bytes = static_cast<std::uint32_t>(sizeof start + text.size() + sizeof chunk + binary.size());
  std::string result;
  append(result, start);
  result += text;
  append(result, chunk);
  return result + binary;
}

}  // namespace vrpipe
