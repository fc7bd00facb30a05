#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "../file_io.h"
#include "camera_format.h"
#include "lens.h"

// A COLMAP model, https://colmap.github.io/format.html: intrinsics in `cameras`, poses in `images`, both as .txt or both
// as .bin; other files of the model are not needed.

namespace vrpipe {
namespace {

namespace fs = std::filesystem;

constexpr char kGetAgain[] = "get or write the file again";
/// Longer than any path.
constexpr std::size_t kMaxNameBytes = 4096;
/// Of the line of an image's points; a million of them.
constexpr std::size_t kMaxLineBytes = std::size_t{64} << 20;

/// Both files of a model.
struct Model {
  fs::path cameras, images;
  bool is_binary = false;
};

bool is_file(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

Model model_in(const fs::path& folder, bool is_binary) {
  const char* const extension = is_binary ? ".bin" : ".txt";
  return {folder / (std::string("cameras") + extension), folder / (std::string("images") + extension), is_binary};
}

/// The model that a folder holds, or that a file is of; no names without one. As COLMAP does, .bin is taken before .txt.
/// Of a model that lacks one of its files, both are named.
Model model_of(const CameraSource& source) {
  if (!source.is_folder()) {
    const fs::path file(source.path());
    for (const bool is_binary : {true, false}) {
      Model model = model_in(file.parent_path(), is_binary);
      if (file.filename() == model.cameras.filename() || file.filename() == model.images.filename()) return model;
    }
    return {};
  }
  const fs::path folder(source.path());
  for (const fs::path& place : {folder, folder / "sparse" / "0", folder / "sparse"}) {
    for (const bool is_binary : {true, false}) {
      Model model = model_in(place, is_binary);
      if (is_file(model.cameras) && is_file(model.images)) return model;
    }
  }
  for (const bool is_binary : {true, false}) {
    Model model = model_in(folder, is_binary);
    if (is_file(model.cameras) || is_file(model.images)) return model;
  }
  return {};
}

/// A camera model. One that has a pinhole among its cameras has it where all parameters that distort are 0.
struct CameraModel {
  const char* name;
  std::size_t
      focal_lengths;  ///< 1 of both sides, or 2; 0: no pinhole, whatever its parameters. Then the principal point
  LensModel lens;
  std::vector<const char*> distortion;  ///< then these

  std::size_t parameters() const { return focal_lengths + 2 + distortion.size(); }
};

/// By their numbers in .bin files.
const std::vector<CameraModel>& models() {
  constexpr LensModel polynomial = LensModel::polynomial;
  static const std::vector<CameraModel> all{
      {"SIMPLE_PINHOLE", 1, polynomial, {}},
      {"PINHOLE", 2, polynomial, {}},
      {"SIMPLE_RADIAL", 1, polynomial, {"k"}},
      {"RADIAL", 1, polynomial, {"k1", "k2"}},
      {"OPENCV", 2, polynomial, {"k1", "k2", "p1", "p2"}},
      {"OPENCV_FISHEYE", 0, polynomial, {}},
      {"FULL_OPENCV", 2, LensModel::rational, {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"}},
      {"FOV", 2, LensModel::field_of_view, {"omega"}},
      {"SIMPLE_RADIAL_FISHEYE", 0, polynomial, {}},
      {"RADIAL_FISHEYE", 0, polynomial, {}},
      {"THIN_PRISM_FISHEYE", 0, polynomial, {}},
      {"RAD_TAN_THIN_PRISM_FISHEYE", 0, polynomial, {}},
      {"SIMPLE_DIVISION", 0, polynomial, {}},
      {"DIVISION", 0, polynomial, {}},
      {"SIMPLE_FISHEYE", 0, polynomial, {}},
      {"FISHEYE", 0, polynomial, {}},
      {"EUCM", 0, polynomial, {}},
      {"EQUIRECTANGULAR", 0, polynomial, {}},
  };
  return all;
}

constexpr char kUndistorter[] = "give the model that `colmap image_undistorter` writes";

[[noreturn]] void refuse_model(const std::string& name, const std::string& where) {
  // A sphere has no pinhole that sees all of it, and what is not known may have none.
  std::string remedy = "give a model of pinholes, or in place of --camera a view of your own, with --eye and --look-at";
  const auto known =
      std::find_if(models().begin(), models().end(), [&](const CameraModel& model) { return name == model.name; });
  if (name == "EQUIRECTANGULAR") {
    remedy =
        "give a model of perspective views of the panoramas, which COLMAP's panorama_sfm.py makes, or in place of "
        "--camera a view of your own, with --eye and --look-at";
  } else if (known != models().end()) {
    remedy = kUndistorter;
  }
  throw UserError(kCannotReadCameras, where, fmt::format("its camera model is {}, which is no pinhole", name), remedy);
}

/// Intrinsics, in a camera that has no pose yet.
Camera intrinsics(const CameraModel& model, double width, double height, const std::vector<double>& parameters,
                  const std::string& file, const std::string& where, Lenses lenses) {
  for (const double parameter : parameters) {
    if (!std::isfinite(parameter)) throw UserError(kCannotReadCameras, where, "a parameter is not finite", kGetAgain);
  }
  Camera camera;
  camera.width = checked_side(width, where, "the width");
  camera.height = checked_side(height, where, "the height");
  camera.fx = parameters[0];
  camera.fy = parameters[model.focal_lengths - 1];
  check_focal_lengths(camera, where, "a parameter");
  set_principal_point(camera, parameters[model.focal_lengths], parameters[model.focal_lengths + 1], where,
                      "a parameter");
  Lens lens;
  lens.model = model.lens;
  for (std::size_t i = 0; i < model.distortion.size(); ++i) {
    lens.parameters.push_back({model.distortion[i], parameters[model.focal_lengths + 2 + i]});
  }
  lens.complaint = fmt::format("its camera model is {}, distorted by", model.name);
  lens.remedy = fmt::format("{}, or --undistorted if the model was trained on undistorted images", kUndistorter);
  if (!lens.parameters.empty()) check_lens(lens, lenses, file, where, camera);
  return camera;
}

/// By the numbers that images give them.
using Intrinsics = std::map<std::uint64_t, Camera>;

void add(Intrinsics& all, std::uint64_t id, const Camera& camera, const std::string& where) {
  if (all.emplace(id, camera).second) return;
  throw UserError(kCannotReadCameras, where, fmt::format("there is a camera {} already", id), kGetAgain);
}

/// An image as it is written: world to camera.
struct Image {
  std::uint64_t id = 0, camera = 0;
  std::array<double, 4> rotation{};  ///< w, x, y, z
  Vec3 translation{};
  std::string name;
};

/// An image's camera with its pose.
Camera posed(const Intrinsics& all, const Image& image, const std::string& where) {
  const auto found = all.find(image.camera);
  if (found == all.end()) {
    throw UserError(kCannotReadCameras, where, fmt::format("there is no camera {}", image.camera),
                    "take both files from the same model");
  }
  double largest = 0;
  bool is_finite = true;
  for (const double part : image.rotation) {
    largest = std::max(largest, std::fabs(part));
    is_finite = is_finite && std::isfinite(part);
  }
  for (std::size_t i = 0; i < 3; ++i) is_finite = is_finite && std::isfinite(image.translation[i]);
  if (!is_finite) throw UserError(kCannotReadCameras, where, "its pose is not finite", kGetAgain);
  if (!(largest > 0)) throw UserError(kCannotReadCameras, where, "its quaternion is zero", kGetAgain);
  // Divided by the largest first, so that no square overflows or vanishes.
  std::array<double, 4> q = image.rotation;
  double squares = 0;
  for (double& part : q) {
    part /= largest;
    squares += part * part;
  }
  const double length = std::sqrt(squares);
  for (double& part : q) part /= length;
  const auto [w, x, y, z] = q;
  Camera camera = found->second;
  // Rows of a rotation from camera to world are columns of the one from world to camera.
  camera.rotation[0] = {1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)};
  camera.rotation[1] = {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)};
  camera.rotation[2] = {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)};
  for (std::size_t row = 0; row < 3; ++row) {
    const Vec3& axis = camera.rotation[row];
    const double at = axis[0] * image.translation[0] + axis[1] * image.translation[1] + axis[2] * image.translation[2];
    camera.eye[row] = -at;
    if (!std::isfinite(at)) throw UserError(kCannotReadCameras, where, "its pose is not finite", kGetAgain);
  }
  camera.name = image.name;
  return camera;
}

/// As the INRIA code orders them; COLMAP writes them in no order.
std::vector<Camera> by_name(std::vector<std::pair<Image, Camera>> images) {
  std::sort(images.begin(), images.end(), [](const auto& a, const auto& b) {
    return std::tie(a.first.name, a.first.id) < std::tie(b.first.name, b.first.id);
  });
  std::vector<Camera> cameras;
  cameras.reserve(images.size());
  for (auto& image : images) cameras.push_back(std::move(image.second));
  return cameras;
}

// Text.

/// The lines of a file, one at a time. At most one is in memory.
class Lines {
 public:
  explicit Lines(const fs::path& path) : file_(path, kCannotReadCameras), path_(path.string()) {}

  /// False at the end.
  bool next() {
    if (position_ == file_.size() && next_ == window_.size()) {
      file_.check_unchanged();
      return false;
    }
    ++number_;
    line_.clear();
    for (bool is_whole = false; !is_whole;) {
      if (next_ == window_.size() && !fill()) break;
      const std::size_t end = std::min(window_.find('\n', next_), window_.size());
      line_.append(window_, next_, end - next_);
      if (line_.size() > kMaxLineBytes) refuse(fmt::format("it is longer than {} bytes", kMaxLineBytes));
      is_whole = end < window_.size();
      next_ = end + (is_whole ? 1 : 0);
    }
    if (!line_.empty() && line_.back() == '\r') line_.pop_back();
    rest_ = line_;
    return true;
  }
  /// The next line that is neither empty nor a comment. False at the end.
  bool next_entry() {
    while (next()) {
      skip_spaces();
      if (!rest_.empty() && rest_.front() != '#') return true;
    }
    return false;
  }
  std::string where() const { return fmt::format("{} line {}", path_, number_); }
  [[noreturn]] void refuse(const std::string& why) const {
    throw UserError(kCannotReadCameras, where(), why, kGetAgain);
  }

  /// The next word of the line; empty at its end.
  std::string_view word() {
    skip_spaces();
    const std::string_view found = rest_.substr(0, std::min(rest_.find_first_of(" \t"), rest_.size()));
    rest_.remove_prefix(found.size());
    return found;
  }
  /// What is left of the line, without spaces around it.
  std::string_view rest() {
    skip_spaces();
    return rest_.substr(0, rest_.find_last_not_of(" \t") + 1);
  }
  template <class Number>
  Number number(const char* name) {
    const std::string_view text = word();
    Number value{};
    const std::from_chars_result parsed = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty()) refuse(fmt::format("it ends before {}", name));
    if (parsed.ec != std::errc{} || parsed.ptr != text.data() + text.size()) {
      refuse(fmt::format("{} is not a number", name));
    }
    return value;
  }

 private:
  void skip_spaces() { rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t"), rest_.size())); }

  /// False at the end of the file.
  bool fill() {
    constexpr std::uint64_t window_bytes = 65536;
    window_.resize(static_cast<std::size_t>(std::min(window_bytes, file_.size() - position_)));
    file_.read(position_, window_.data(), window_.size());
    position_ += window_.size();
    next_ = 0;
    return !window_.empty();
  }

  InputFile file_;
  std::string path_;
  std::string window_, line_;
  std::string_view rest_;
  std::uint64_t position_ = 0;  ///< in the file, of the window's end
  std::size_t next_ = 0;        ///< in the window
  std::size_t number_ = 0;
};

Intrinsics read_cameras_text(const fs::path& path, Lenses lenses) {
  Intrinsics cameras;
  for (Lines lines(path); lines.next_entry();) {
    const auto id = lines.number<std::uint64_t>("the number of the camera");
    const std::string name(lines.word());
    const auto model =
        std::find_if(models().begin(), models().end(), [&](const CameraModel& known) { return name == known.name; });
    if (name.empty()) lines.refuse("it ends before the camera model");
    if (model == models().end() || model->focal_lengths == 0) refuse_model(name.substr(0, 64), lines.where());
    const auto width = lines.number<double>("the width");
    const auto height = lines.number<double>("the height");
    std::vector<double> parameters;
    for (std::size_t i = 0; i < model->parameters(); ++i) parameters.push_back(lines.number<double>("a parameter"));
    if (!lines.rest().empty()) {
      lines.refuse(fmt::format("{} has {} parameters, and there are more", name, model->parameters()));
    }
    add(cameras, id, intrinsics(*model, width, height, parameters, path.string(), lines.where(), lenses),
        lines.where());
  }
  return cameras;
}

std::vector<Camera> read_images_text(const fs::path& path, const Intrinsics& cameras) {
  std::vector<std::pair<Image, Camera>> images;
  for (Lines lines(path); lines.next_entry();) {
    Image image;
    image.id = lines.number<std::uint64_t>("the number of the image");
    for (double& part : image.rotation) part = lines.number<double>("a number of the quaternion");
    for (std::size_t i = 0; i < 3; ++i) image.translation[i] = lines.number<double>("a number of the translation");
    image.camera = lines.number<std::uint64_t>("the number of the camera");
    image.name = lines.rest();
    if (image.name.empty()) lines.refuse("it ends before the name of the image");
    Camera camera = posed(cameras, image, lines.where());
    images.emplace_back(std::move(image), std::move(camera));
    // Its points are not needed. A file without lines of points would lose every second image.
    if (!lines.next()) break;
    std::size_t words = 0;
    while (!lines.word().empty()) ++words;
    if (words % 3 != 0) lines.refuse("it is not the line of an image's points, three numbers each");
  }
  return by_name(std::move(images));
}

// Binary.

/// A file from its beginning to its end. Takes nothing from the file's own counts that the file has no bytes for.
class Bytes {
 public:
  explicit Bytes(const fs::path& path) : file_(path, kCannotReadCameras), path_(path.string()) {}

  std::string where() const { return fmt::format("{} byte {}", path_, position_); }
  [[noreturn]] void refuse(const std::string& why) const {
    throw UserError(kCannotReadCameras, where(), why, kGetAgain);
  }
  template <class Number>
  Number number(const char* name) {
    Number value;
    if (file_.size() - position_ < sizeof value) refuse(fmt::format("the file ends before {}", name));
    fill(sizeof value);
    std::memcpy(&value, window_.data() + (position_ - window_start_), sizeof value);
    position_ += sizeof value;
    return value;
  }
  /// A text that ends with a zero byte.
  std::string text(const char* name) {
    std::string value;
    for (;;) {
      const char c = number<char>(name);
      if (c == '\0') return value;
      if (value.size() == kMaxNameBytes) refuse(fmt::format("{} is longer than {} bytes", name, kMaxNameBytes));
      value += c;
    }
  }
  void skip(std::uint64_t count, std::uint64_t size_bytes, const char* name) {
    if (count > (file_.size() - position_) / size_bytes) {
      refuse(fmt::format("there are to be {} {}, and the file ends before", count, name));
    }
    position_ += count * size_bytes;
  }
  void finish() const {
    if (position_ != file_.size()) refuse("the file goes on after all that its count says");
    file_.check_unchanged();
  }

 private:
  void fill(std::size_t bytes) {
    if (position_ >= window_start_ && position_ - window_start_ + bytes <= window_.size()) return;
    constexpr std::uint64_t window_bytes = 4096;
    window_start_ = position_;
    window_.resize(static_cast<std::size_t>(std::min(window_bytes, file_.size() - position_)));
    file_.read(window_start_, window_.data(), window_.size());
  }

  InputFile file_;
  std::string path_;
  std::uint64_t position_ = 0, window_start_ = 0;
  std::vector<std::byte> window_;
};

Intrinsics read_cameras_binary(const fs::path& path, Lenses lenses) {
  Intrinsics cameras;
  Bytes bytes(path);
  const auto count = bytes.number<std::uint64_t>("the number of cameras");
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::string where = bytes.where();
    const auto id = bytes.number<std::uint32_t>("a camera");
    const auto number = bytes.number<std::uint32_t>("a camera model");
    if (number >= models().size()) refuse_model(fmt::format("number {}", number), where);
    const CameraModel& model = models()[number];
    if (model.focal_lengths == 0) refuse_model(model.name, where);
    const auto width = bytes.number<std::uint64_t>("a width");
    const auto height = bytes.number<std::uint64_t>("a height");
    std::vector<double> parameters;
    for (std::size_t k = 0; k < model.parameters(); ++k) parameters.push_back(bytes.number<double>("a parameter"));
    add(cameras, id,
        intrinsics(model, static_cast<double>(width), static_cast<double>(height), parameters, path.string(), where,
                   lenses),
        where);
  }
  bytes.finish();
  return cameras;
}

std::vector<Camera> read_images_binary(const fs::path& path, const Intrinsics& cameras) {
  std::vector<std::pair<Image, Camera>> images;
  Bytes bytes(path);
  const auto count = bytes.number<std::uint64_t>("the number of images");
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::string where = bytes.where();
    Image image;
    image.id = bytes.number<std::uint32_t>("an image");
    for (double& part : image.rotation) part = bytes.number<double>("a quaternion");
    for (std::size_t k = 0; k < 3; ++k) image.translation[k] = bytes.number<double>("a translation");
    image.camera = bytes.number<std::uint32_t>("the number of a camera");
    image.name = bytes.text("the name of an image");
    const auto points = bytes.number<std::uint64_t>("the number of an image's points");
    constexpr std::uint64_t point_bytes = 24;
    bytes.skip(points, point_bytes, "points");
    Camera camera = posed(cameras, image, where);
    images.emplace_back(std::move(image), std::move(camera));
  }
  bytes.finish();
  return by_name(std::move(images));
}

bool is_colmap(const CameraSource& source) { return !model_of(source).cameras.empty(); }

std::vector<Camera> read_colmap(const CameraSource& source, Lenses lenses) {
  const Model model = model_of(source);
  if (model.is_binary) return read_images_binary(model.images, read_cameras_binary(model.cameras, lenses));
  return read_images_text(model.images, read_cameras_text(model.cameras, lenses));
}

std::vector<fs::path> files(const CameraSource& source) {
  const Model model = model_of(source);
  return {model.cameras, model.images};
}

const CameraFormatRegistrar colmap_registrar(
    {"COLMAP model", "a folder with cameras.bin and images.bin or cameras.txt and images.txt, or one of these",
     is_colmap, read_colmap, files});

}  // namespace
}  // namespace vrpipe
