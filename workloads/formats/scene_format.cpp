#include "formats/scene_format.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <utility>

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/portable_math.h>

#include "file_io.h"

namespace vrpipe {
namespace {

namespace fs = std::filesystem;

/// Of a built-in table, and of whatever a static object registers before main.
std::vector<SceneFormat>& registry() {
  static std::vector<SceneFormat> formats;
  return formats;
}

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

bool exists(const std::string& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

/// A `#` may be part of a name: then there is a file of this name.
std::size_t choice_mark(const std::string& text) { return exists(text) ? std::string::npos : text.rfind('#'); }

std::map<std::string, std::string> parse_choices(const std::string& text, const std::string& where) {
  std::map<std::string, std::string> choices;
  std::size_t from = 0;
  while (from <= text.size()) {
    const std::size_t comma = std::min(text.find(',', from), text.size());
    const std::string part = text.substr(from, comma - from);
    const std::size_t equals = part.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == part.size()) {
      throw UserError(kCannotReadScene, where, "`" + part + "` behind # is not KEY=VALUE", "give e.g. FILE#lod=2");
    }
    if (!choices.emplace(part.substr(0, equals), part.substr(equals + 1)).second) {
      throw UserError(kCannotReadScene, where, "`" + part.substr(0, equals) + "` is there twice behind #",
                      "give it once");
    }
    from = comma + 1;
  }
  return choices;
}

/// In a folder, the file that says what the others are.
fs::path with_index_file(const fs::path& path) {
  std::error_code ignored;
  if (!fs::is_directory(path, ignored)) return path;
  for (const char* name : {"lod-meta.json", "meta.json"}) {
    if (fs::is_regular_file(path / name, ignored)) return path / name;
  }
  throw UserError(kCannotReadScene, path.string(), "it is a directory without a meta.json or lod-meta.json",
                  "name a file in it, or a folder in which SOG was unpacked");
}

void check_choices(const SceneFile& file, const SceneFormat& format) {
  for (const auto& choice : file.choices) {
    const std::string& key = choice.first;
    const auto known = std::find_if(format.choices.begin(), format.choices.end(),
                                    [&](const FormatChoice& allowed) { return allowed.key == key; });
    if (known != format.choices.end()) continue;
    std::string remedy = "leave it out";
    for (const FormatChoice& allowed : format.choices) remedy += ", or give #" + allowed.key + "=VALUE";
    throw UserError(kCannotReadScene, file.bytes.where(), "the format " + format.name + " has no `" + key + "`",
                    remedy);
  }
}

/// Far from the origin the steps of single precision are wider than splats. Empty where they are not.
std::string precision_note(const GaussianScene& scene) {
  constexpr float kFar = 256;
  std::uint64_t too_small = 0;
  float widest = 0;
  for (std::uint64_t i = 0; i < scene.size(); ++i) {
    const GaussianRef gaussian = scene[i];
    float farthest = 0;
    for (const float coordinate : gaussian.position()) farthest = std::max(farthest, std::fabs(coordinate));
    if (!(farthest >= kFar) || !std::isfinite(farthest)) continue;
    const float step = std::nextafter(farthest, std::numeric_limits<float>::infinity()) - farthest;
    const std::array<float, 3> log_scale = gaussian.log_scale();
    if (static_cast<double>(step) <= portable_exp(*std::max_element(log_scale.begin(), log_scale.end()))) continue;
    ++too_small;
    widest = std::max(widest, step);
  }
  if (too_small * 100 < scene.size() || too_small == 0) return {};
  return fmt::format(
      "positions are of single precision, in steps of up to {} so far from the origin, and {:.0f} % of the Gaussians "
      "are "
      "smaller than that: it has moved them; positions in double (.ply), or nearer to the origin, keep their places",
      widest, 100.0 * static_cast<double>(too_small) / static_cast<double>(scene.size()));
}

/// What other programs have for their own.
struct ForeignFormat {
  const char* extension;
  const char* what;
  const char* remedy;
};
constexpr char kWithSplatTransform[] = "convert it to .ply, by PlayCanvas' splat-transform for one";
constexpr ForeignFormat kForeignFormats[] = {
    {".lcc", "a scene of XGRIDS' LCC", kWithSplatTransform},
    {".lcc2", "a scene of XGRIDS' LCC", kWithSplatTransform},
    {".spx", "a scene of Reall3dViewer", "convert it to .ply or .spz, by gsbox for one"},
    {".rad", "a scene in levels of detail of Spark", "give the file that it was made from"},
    {".ckpt", "a checkpoint of a training",
     "export the Gaussians as .ply, in nerfstudio by `ns-export gaussian-splat`"},
    {".pt", "a checkpoint of a training", "export the Gaussians as .ply"},
    {".pth", "a checkpoint of a training", "export the Gaussians as .ply"},
    {".usdz", "a scene of OpenUSD", "export the Gaussians as .ply"},
    {".usd", "a scene of OpenUSD", "export the Gaussians as .ply"},
};

/// Of a file that no reader takes.
[[noreturn]] void fail_of_unknown(const SceneFile& file) {
  for (const ForeignFormat& foreign : kForeignFormats) {
    if (file.ends_with(foreign.extension))
      file.bytes.fail(std::string("it is ") + foreign.what + ", which is not read", foreign.remedy);
  }
  std::string known;
  for (const SceneFormat& format : registry()) known += (known.empty() ? "" : ", ") + format.name;
  file.bytes.fail("neither its content nor its name is that of a known format",
                  "known are " + known + "; draw lists (.spl) and builtin:NAME");
}

}  // namespace

bool SceneFile::ends_with(const std::string& extension) const { return vrpipe::ends_with(name, extension); }

SceneFormatRegistrar::SceneFormatRegistrar(SceneFormat format) {
  // By name, since the order in which static objects come to life is not defined.
  std::vector<SceneFormat>& formats = registry();
  const auto place =
      std::find_if(formats.begin(), formats.end(), [&](const SceneFormat& other) { return format.name < other.name; });
  formats.insert(place, std::move(format));
}

void set_anti_aliased(GaussianFile& file, const std::string& said) {
  if (file.gaussians.compensates_opacity()) return;
  file.gaussians.set_compensates_opacity(true);
  file.notes.push_back("it was trained anti-aliased (`" + said +
                       "`): preprocess.opacity_compensation is on unless it is set");
}

const std::vector<SceneFormat>& scene_formats() { return registry(); }

std::vector<GaussianFormat> gaussian_formats() {
  std::vector<GaussianFormat> formats;
  for (const SceneFormat& format : registry()) {
    formats.push_back({format.name, format.files, format.meaning, format.choices, format.write != nullptr});
  }
  return formats;
}

GaussianFile read_scene(const SceneFile& file) try {
  const SceneFormat* best = nullptr;
  Match match = Match::no;
  for (const SceneFormat& format : registry()) {
    const Match here = format.match(file);
    if (here > match) {
      match = here;
      best = &format;
    }
  }
  // A checkpoint is a zip archive as well.
  if (best == nullptr || match == Match::by_container) {
    const auto is_foreign = [&](const ForeignFormat& foreign) { return file.ends_with(foreign.extension); };
    if (best == nullptr || std::any_of(std::begin(kForeignFormats), std::end(kForeignFormats), is_foreign))
      fail_of_unknown(file);
  }
  check_choices(file, *best);
  GaussianFile scene = best->read(file);
  scene.format = best->name;
  if (std::string note = precision_note(scene.gaussians); !note.empty()) scene.notes.push_back(std::move(note));
  return scene;
} catch (const std::bad_alloc&) {
  file.bytes.fail("it needs more memory than there is", "raise the limit on memory, or use a smaller scene");
}

std::string gaussian_file_path(const std::string& text) { return text.substr(0, choice_mark(text)); }

GaussianFile read_gaussian_file(const std::string& text) {
  const std::size_t mark = choice_mark(text);
  const fs::path path = with_index_file(text.substr(0, mark));
  SceneFile file;
  file.name = lower_case(path.filename().string());
  if (mark != std::string::npos) file.choices = parse_choices(text.substr(mark + 1), path.string());
  file.bytes = FileBytes::read(path);
  file.neighbour = [path](const std::string& name) {
    constexpr std::size_t kLongest = 1000;
    const bool is_name = name.size() <= kLongest && name.find('\0') == std::string::npos;
    const fs::path relative = is_name ? fs::path(name).lexically_normal() : fs::path();
    if (relative.empty() || relative.is_absolute() || *relative.begin() == "..") {
      throw UserError(kCannotReadScene, path.string(), "it names the file `" + name.substr(0, 100) + "`",
                      "the files of a scene lie in its folder");
    }
    return FileBytes::read(path.parent_path() / relative);
  };
  return read_scene(file);
}

std::vector<std::string> write_gaussian_file(const fs::path& path, const GaussianFile& scene) {
  const std::string name = lower_case(path.filename().string());
  std::string known;
  for (const SceneFormat& format : registry()) {
    if (format.write == nullptr) continue;
    if (ends_with(name, format.extension)) return format.write(path, scene);
    known += (known.empty() ? "" : " or ") + format.extension;
  }
  throw UserError("cannot write scene", path.string(), "its extension is not that of a format that is written",
                  "give a name that ends in " + known);
}

std::vector<std::string> write_gaussian_file(const fs::path& path, const GaussianScene& scene) {
  GaussianFile file;
  file.gaussians = scene;
  return write_gaussian_file(path, file);
}

}  // namespace vrpipe
