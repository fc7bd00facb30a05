#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include <vrpipe/workloads/gaussian_file.h>

#include "formats/file_bytes.h"

namespace vrpipe {

/// A file of Gaussians as its reader gets it.
struct SceneFile {
  std::string name;                            ///< without folder, in lower case
  FileBytes bytes;                             ///< of the whole file
  std::map<std::string, std::string> choices;  ///< what stands behind `#`, by key; of its format's keys alone
  std::function<FileBytes(const std::string& name)> neighbour;  ///< another file of its folder, or below

  bool ends_with(const std::string& extension) const;
};

/// How well a file fits a format.
enum class Match {
  no,
  by_name,       ///< of a format that has no header, or whose header is not there
  by_container,  ///< a .ply, a zip archive, a gzip stream, in which the format may be
  by_content     ///< its header is that of the format
};

/// A format of Gaussians. Each is declared in one file of this room, by a SceneFormatRegistrar; nothing else knows it.
struct SceneFormat {
  std::string name;                   ///< e.g. "INRIA .ply"
  std::string files;                  ///< how its files are called, e.g. "FILE.spz"
  std::string meaning;                ///< one line
  std::vector<FormatChoice> choices;  ///< the keys that it takes behind `#`
  Match (*match)(const SceneFile& file);
  /// @throws UserError for whatever is not as the format has it
  GaussianFile (*read)(const SceneFile& file);
  /// Null for a format that is not written. Returns what of the scene is not in the file, a sentence each.
  std::vector<std::string> (*write)(const std::filesystem::path& path, const GaussianFile& scene) = nullptr;
  std::string extension{};  ///< of files that are written, e.g. ".ply"
};

class SceneFormatRegistrar {
 public:
  explicit SceneFormatRegistrar(SceneFormat format);
};

/// Its Gaussians were trained anti-aliased, and `said` is where the file says so; call it when they are there.
void set_anti_aliased(GaussianFile& file, const std::string& said);

/// All formats, by name.
const std::vector<SceneFormat>& scene_formats();

/// Reads a file whose bytes are there; what read_gaussian_file() does once it has them.
/// @throws UserError
GaussianFile read_scene(const SceneFile& file);

}  // namespace vrpipe
