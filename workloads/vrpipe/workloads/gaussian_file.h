#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <vrpipe/workloads/camera.h>
#include <vrpipe/workloads/gaussian_scene.h>

namespace vrpipe {

/// Gaussians of a file, and what else it says. Positions and rotations are in the world of INRIA's files: a format with axes of
/// its own (.spz) is turned into it.
struct GaussianFile {
  GaussianScene gaussians;
  std::string format;              ///< as GaussianFormat has it
  Vec3 up{0, -1, 0};               ///< of its world, as far as the file or the format says; else y points down
  std::vector<std::string> notes;  ///< what of the file is not used, or was assumed; a sentence each
};

/// A key that a format takes behind its file's name: FILE#KEY=VALUE[,KEY=VALUE].
struct FormatChoice {
  std::string key;      ///< e.g. "lod"
  std::string meaning;  ///< one line, with the values and the default
};

/// A format of Gaussians that is read, and perhaps written.
struct GaussianFormat {
  std::string name;     ///< e.g. "INRIA .ply"
  std::string files;    ///< how its files are called, e.g. "FILE.spz"
  std::string meaning;  ///< one line
  std::vector<FormatChoice> choices;
  bool is_written;  ///< by write_gaussian_file
};

/// All of them, by name.
std::vector<GaussianFormat> gaussian_formats();

/// Reads a file of Gaussians, on all cores. Its format is recognised by its content where the format has a header, else by its
/// name and size. Quantised values become those that the format defines, rounded once to float32; a linear opacity of 0 or 1
/// becomes a logit of -40 or 40, which is 0 or 1 in float32 again. Memory stays in proportion to the file, whatever it announces.
/// @param text  FILE, FOLDER (with a meta.json or lod-meta.json), or either with #KEY=VALUE; see gaussian_formats()
/// @throws UserError when the file cannot be read, is in no known format, is cut short or damaged, or is written meanwhile
GaussianFile read_gaussian_file(const std::string& text);

/// Writes in the format of the name's extension, with what the file says beside its Gaussians as far as the format can say it.
/// The file appears complete or not at all.
/// @return what of the scene is not in the file, a sentence each
/// @throws UserError when it cannot be written, or no format with this extension is written
std::vector<std::string> write_gaussian_file(const std::filesystem::path& path, const GaussianFile& scene);
/// Gaussians of which nothing else is to be said.
std::vector<std::string> write_gaussian_file(const std::filesystem::path& path, const GaussianScene& scene);

/// The file that `text` names, without what follows `#`.
std::string gaussian_file_path(const std::string& text);

}  // namespace vrpipe
