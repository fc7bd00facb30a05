#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/camera.h>

namespace vrpipe {

/// A file or folder that is to hold cameras.
class CameraSource {
 public:
  explicit CameraSource(std::string path);
  ~CameraSource();

  const std::string& path() const { return path_; }
  bool is_folder() const { return is_folder_; }
  /// Its content as JSON; null for what is none. Read when it is asked for first.
  /// @throws UserError when the file cannot be read
  const nlohmann::json* json() const;
  /// What keeps a file that begins as JSON does from being JSON; none for others, and before json() was asked for.
  const std::optional<UserError>& complaint() const { return complaint_; }

 private:
  std::string path_;
  bool is_folder_;
  mutable bool is_read_ = false;
  mutable std::unique_ptr<const nlohmann::json> json_;
  mutable std::optional<UserError> complaint_;
};

/// A kind of camera file: each has a file of this folder, which registers it. No source is recognised by two of them.
struct CameraFormat {
  const char* name;
  const char* looks_like;  ///< for the message about a file that is none of them
  bool (*recognises)(const CameraSource& source);
  /// Only of what it recognises. Throws UserError naming the camera, the line or the byte.
  std::vector<Camera> (*read)(const CameraSource& source, Lenses lenses);
  /// The files that are read, where these are not the source itself; else null.
  std::vector<std::filesystem::path> (*files)(const CameraSource& source);
};

/// In the order of their names.
const std::vector<CameraFormat>& camera_formats();

/// In a static object: adds a format.
struct CameraFormatRegistrar {
  explicit CameraFormatRegistrar(const CameraFormat& format);
};

// What every format has to see to.

constexpr char kCannotReadCameras[] = "cannot read camera file";

/// Of an image, pixels. @throws UserError unless it is a whole number of 1 to kMaxImageSize
std::uint32_t checked_side(double side, const std::string& where, const std::string& name);

/// @throws UserError unless the columns are unit vectors at right angles and right-handed
/// @param name  of the matrix in the file, e.g. "\"rotation\""
void check_rotation(const Camera& camera, const std::string& where, const std::string& name, const std::string& remedy);

/// @param cx,cy  of the principal point, pixels from the image's upper left corner; none: of the centre
/// @param names  of these in the file
/// @throws UserError when it is farther than kMaxPrincipalOffset from the centre
void set_principal_point(Camera& camera, const std::optional<double>& cx, const std::optional<double>& cy,
                         const std::string& where, const std::string& names);

/// @throws UserError unless the focal lengths are those of an image that can be drawn
void check_focal_lengths(const Camera& camera, const std::string& where, const std::string& names);

/// An object in a JSON file. What is wrong with a value names the place and the file's layout.
class JsonObject {
 public:
  /// @throws UserError when it is no object
  JsonObject(const nlohmann::json& json, std::string where, const char* layout);

  const std::string& where() const { return where_; }
  /// Null when there is none, also for a null.
  const nlohmann::json* find(const char* key) const;
  const nlohmann::json& at(const char* key) const;
  double number(const char* key) const { return number(at(key), quoted(key)); }
  std::optional<double> optional_number(const char* key) const;
  double number(const nlohmann::json& value, const std::string& name) const;
  /// The text of a key; empty when it has none.
  std::string text(const char* key) const;

  static std::string quoted(const char* key) { return std::string("\"") + key + "\""; }
  [[noreturn]] void refuse(const std::string& why) const;

 private:
  const nlohmann::json& json_;
  std::string where_;
  const char* layout_;
};

}  // namespace vrpipe
