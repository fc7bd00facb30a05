#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

namespace vrpipe {

using Vec3 = glm::dvec3;

/// Largest width and height of an image, pixels.
constexpr std::uint32_t kMaxImageSize = 16384;

struct ImageSize {
  std::uint32_t width = 0, height = 0;  ///< pixels, 1 to kMaxImageSize
};

enum class Projection : std::uint8_t {
  perspective,   ///< through the eye: a pinhole
  orthographic,  ///< along the view direction
};

/// A camera without distortion in the INRIA frame: x right, y down, z forward; pixels have their centres at +0.5.
struct Camera {
  Vec3 eye{};  ///< camera centre, world units
  std::array<Vec3, 3> rotation{
      {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  ///< camera to world, rows; columns right, down, forward
  Projection projection = Projection::perspective;
  double fx = 1, fy = 1;  ///< focal lengths, pixels; orthographic: pixels that a world unit spans
  /// The principal point, pixels right of and below the image's centre: so a part of an image, cut around its centre, and an
  /// image of another size have a principal point without more ado.
  double principal_x = 0, principal_y = 0;
  std::uint32_t width = 1, height = 1;  ///< pixels
  float near_plane = 0.2f;    ///< world units, >= 1e-6; Gaussians at camera z <= near_plane are culled (0.2 as INRIA)
  float far_plane = 1000.0f;  ///< world units, above near_plane, finite; meshes end here, Gaussians do not
  std::string name;           ///< of the image that it took, as its file has it; empty without
  std::vector<std::string> notes;  ///< what of its file is not used, or was assumed; a sentence each

  /// The principal point, pixels from the image's upper left corner.
  double cx() const { return 0.5 * width + principal_x; }
  double cy() const { return 0.5 * height + principal_y; }
};

/// A point of the world, as the camera sees it: right, down and forward of the eye, world units. Its window position is
/// cx + fx x / w, cy + fy y / w.
Vec3 camera_space(const Camera& camera, const Vec3& world);

/// By what window positions are divided at camera z: z, and 1 without perspective.
double clip_w(const Camera& camera, double z);

/// Window depth at camera z, of meshes and of splats: 0 at the near plane, 1 at the far plane, linear in 1 / z, and without
/// perspective in z, as OpenGL's projections with a clip volume of 0 to 1. What is not between the planes is clamped to them.
double window_depth(const Camera& camera, double z);

/// Where a camera stands and what it looks at, without the image.
struct View {
  Vec3 eye{};
  Vec3 look_at{0, 0, 1};
  Vec3 up{0, -1, 0};         ///< the world's up direction; y points down in COLMAP and INRIA worlds
  double fovy_degrees = 50;  ///< vertical field of view, of a perspective
  /// World units that the image's height spans, without perspective; none: a perspective.
  std::optional<double> orthographic_height{};
  std::string up_source = "--up";  ///< where `up` comes from, for messages: an option, or a scene
};

/// Of View::orthographic_height.
constexpr double kMinOrthographicHeight = 1e-9, kMaxOrthographicHeight = 1e9;

/// The camera at `eye` that looks at `target`, its image upright with respect to the world direction `up`.
/// @throws UserError when a value is not finite, eye == target, up is zero or parallel to the view direction,
///         fovy is not in [1e-6, 180 - 1e-3) degrees, or a side of the image is not in 1 to kMaxImageSize
Camera look_at(const Vec3& eye, const Vec3& target, const Vec3& up, double fovy_degrees, std::uint32_t width,
               std::uint32_t height);
/// Of a view without perspective, the field of view does not matter.
/// @throws UserError also when an orthographic height is not kMinOrthographicHeight to kMaxOrthographicHeight
Camera look_at(const View& view, ImageSize size);

/// An axis to name as up in place of one that is parallel to the view from `eye` to `target`, as --up takes it.
std::string up_for_view(const Vec3& eye, const Vec3& target);

/// The same camera with another image size. Keeps the vertical field of view and the pixels' shape: the focal lengths and the
/// principal point's distance from the centre scale by the ratio of the heights.
/// @throws UserError when a side is not in 1 to kMaxImageSize
Camera resized(const Camera& camera, ImageSize size);

/// The views that go round `view.look_at` on a level circle through `view.eye`: `count` of them at equal angles around
/// `view.up`, counter-clockwise as seen from above. The first is `view` itself.
/// @throws UserError when `view` has no up
std::vector<View> orbit_views(const View& view, std::size_t count);

/// What a file's lens distortion is taken for. It counts as none where it moves no pixel by more than kLeastDistortion.
enum class Lenses : std::uint8_t {
  as_written,  ///< a camera that is distorted is refused, unless nerfstudio wrote it, which trains on undistorted images
  undistorted,  ///< the images were undistorted before training: the camera is taken without distortion
};
constexpr double kLeastDistortion = 0.1;  ///< pixels

/// Reads all cameras of a file, or of a folder. Which of these it is, its content says:
/// INRIA cameras.json: an array of {"width", "height", "position": [3] = camera centre, "rotation": [3][3] camera to world,
/// "fx", "fy" in pixels, "img_name"}; and "cx", "cy", which some versions add.
/// NeRF transforms.json (Blender, instant-ngp, nerfstudio): {"frames": [{"transform_matrix": [4][4] camera to world of a
/// camera whose x is right, y up and z back, "file_path"}]} with "fl_x", "fl_y", "cx", "cy", "w", "h" in pixels or
/// "camera_angle_x", "camera_angle_y" in radians, of a frame or of all. Without a size images are 800x800, as in NeRF's synthetic
/// data sets, and Camera::notes say so. A "camera_model" ORTHOPHOTO is orthographic. A camera that is distorted or neither a
/// pinhole nor orthographic, and a matrix that scales, are refused.
/// COLMAP model: cameras and images, both .bin or both .txt, in a folder, in its sparse/0 or in its sparse; or the name of
/// one of the files. Cameras are in the order of their images' names. Camera models other than SIMPLE_PINHOLE and PINHOLE
/// are refused unless they are one, without distortion.
/// Principal points are the centre where a file has none. Other keys and files are ignored. Camera::notes say what was taken as
/// undistorted.
/// @throws UserError naming the camera, the line or the byte when a file cannot be read or a camera in it cannot be used
std::vector<Camera> load_cameras(const std::string& path, Lenses lenses = Lenses::as_written);

/// The files that load_cameras(path) reads, as far as their names tell.
std::vector<std::filesystem::path> camera_files(const std::string& path);

/// A camera of a file.
struct CameraName {
  std::string file;
  std::size_t index = 0;  ///< in load_cameras(file)
  std::string image;      ///< Camera::name
};

/// FILE, or FILE#CAMERA.
struct CameraChoice {
  std::string file;
  std::optional<std::string> camera;  ///< none: the text does not say
};

/// What `text` says. All of it is the file's name if there is such a file.
CameraChoice camera_choice(const std::string& text);

struct NamedCamera {
  Camera camera;
  CameraName name;
};

/// The camera that `text` names: FILE, the first; FILE#INDEX, index from 0; or FILE#NAME, an image's name as the file has
/// it, or, where that leaves no doubt, without its folder or its extension. A number is an index; with leading zeros it
/// is a name.
/// @throws UserError as load_cameras, and when there is no such camera or more than one
NamedCamera camera_from_file(const std::string& text, const std::optional<ImageSize>& size = std::nullopt,
                             Lenses lenses = Lenses::as_written);

/// Farthest principal point from the image's centre, pixels.
constexpr double kMaxPrincipalOffset = 1e6;

/// Checks all that projections need of a camera: the image's size, finite elements, focal lengths above 0, a principal point
/// within kMaxPrincipalOffset, and 1e-6 <= near_plane < far_plane.
/// @throws UserError that begins with `what`, e.g. "cannot preprocess the scene"
void check_camera(const Camera& camera, const std::string& what);

/// @throws UserError unless both sides are 1 to kMaxImageSize; `where` names the option or file
void check_image_size(std::uint64_t width, std::uint64_t height, const std::string& where);

}  // namespace vrpipe
