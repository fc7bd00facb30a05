#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "formats/file_bytes.h"
#include "formats/scene_format.h"

namespace vrpipe {

/// What to do about a glTF that cannot be read.
constexpr char kGltfRemedy[] = "export it again, as uncompressed KHR_gaussian_splatting or as .ply";

/// Whether the file is a .glb; else it may be a .gltf.
bool is_glb(const FileBytes& file);

/// The numbers of an accessor, all of which are there.
struct AccessorNumbers {
  FileBytes bytes;  ///< holds them
  const std::byte* first = nullptr;
  std::uint64_t count = 0, stride = 0;
  std::uint64_t type = 0;  ///< as glTF's componentType
  bool normalized = false;

  /// A component of an element, of 0 to 1 or -1 to 1 where it is normalized.
  double at(std::uint64_t index, std::size_t component) const;
};

/// A glTF 2.0 document and its buffers: in the .glb, in files beside it, or in data URIs. References and extents are checked, and
/// what is wrong is a UserError. `place` is where in the document, for the message.
class GltfData {
 public:
  using Json = nlohmann::json;

  explicit GltfData(const SceneFile& file);

  const Json& document() const { return document_; }
  /// Bytes of the buffers that were read.
  std::uint64_t bytes_read() const { return bytes_read_; }
  [[noreturn]] void fail(const std::string& why, const std::string& remedy = kGltfRemedy) const;

  /// A value that is an array.
  const Json& array(const Json& value, const std::string& place) const;
  /// Element `index` of an array of objects of the document, e.g. of "nodes".
  const Json& element(const char* kind, std::uint64_t index, const std::string& place) const;
  std::uint64_t whole(const Json& object, const char* name, const std::string& place) const;
  std::uint64_t whole_or(const Json& object, const char* name, std::uint64_t otherwise, const std::string& place) const;
  /// The member `name`, which is there, as so many finite numbers.
  std::vector<double> doubles(const Json& object, const char* name, std::size_t length, const std::string& place) const;
  /// The accessor that `attributes` has as `name`, of 1, 3 or 4 components each; reads its buffer.
  AccessorNumbers numbers(const Json& attributes, const std::string& name, std::uint64_t components,
                          const std::string& place);

 private:
  void read_chunks();
  const FileBytes& buffer(std::uint64_t index, const std::string& place);
  FileBytes from_data_uri(const std::string& uri) const;

  const SceneFile& file_;
  Json document_;
  std::optional<FileBytes> binary_;  ///< of a .glb
  std::map<std::uint64_t, FileBytes> buffers_;
  std::uint64_t bytes_read_ = 0;
};

}  // namespace vrpipe
