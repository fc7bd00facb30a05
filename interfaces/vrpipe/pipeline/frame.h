#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/pipeline/draw.h>
#include <vrpipe/pipeline/draw_state.h>
#include <vrpipe/pipeline/payload.h>

namespace vrpipe {

/// What is cleared between draws, for the whole framebuffer.
struct Clear {
  bool color = false;        ///< to 0
  bool termination = false;  ///< the termination bits of the stencil, to 0: every pixel is open again
  bool depth = false;
  bool stencil = false;  ///< all bits but that of termination
  float depth_value = 1;
  std::uint8_t stencil_value = 0;
};

/// Splats, or triangles of a mesh, drawn with one state.
struct DrawCall {
  std::string name;  ///< for reports
  DrawState state;
  std::shared_ptr<const Draw> geometry;
  std::uint32_t first = 0;   ///< splat of the geometry that is drawn first
  std::uint32_t splats = 0;  ///< drawn from there on
  /// What the first one is called in the frame, where splats are numbered through all draws; set by the frame.
  std::uint32_t base = 0;
  /// Clears of termination before this draw, of those that DRAW issues; set by the frame.
  std::uint16_t epoch = 0;

  const Splat& splat(std::uint32_t number) const { return geometry->splats[first + (number - base)]; }
  /// Null where the splat is drawn as its box.
  const ScreenTriangle* triangle(std::uint32_t number) const {
    return geometry->triangles.empty() ? nullptr : &geometry->triangles[first + (number - base)];
  }
  /// Of a mesh.
  const MeshTriangle& mesh_triangle(std::uint32_t number) const { return geometry->mesh[first + (number - base)]; }
};

/// What an application has drawn into one framebuffer: clears and draws, in order. The framebuffer is cleared at first: to 0,
/// its depth to 1.
///
/// Draws overlap in the pipeline. Those that follow one another with equal state share bins, warps and merging, as if
/// they were one; before a draw of another state, and before a clear, TGC and TC hand on what they hold.
class Frame {
 public:
  /// width and height in pixels. Throws UserError for a side that is 0 or beyond 16384.
  Frame(std::uint32_t width, std::uint32_t height);
  /// A frame of one draw, which it refers to and which outlives it.
  static std::shared_ptr<Frame> of(const Draw& draw, const DrawState& state = {});

  std::uint32_t width() const { return width_; }
  std::uint32_t height() const { return height_; }
  /// Of its depth target.
  DepthFormat depth_format() const { return depth_format_; }
  void set_depth_format(DepthFormat format) { depth_format_ = format; }

  /// Splats `first` to `first` + `splats` - 1 of a geometry, all of it by default. Throws UserError for one of another
  /// size than the frame's, splats that it does not have, triangles that are not as many as its splats, a mesh that has splats,
  /// a shader for what it is not, late tests where nothing is shaded or tests are early, early termination without blending
  /// or beside a draw that has all bits of the stencil, a stencil reference beyond its bits, and more than 32767 draws,
  /// 65534 commands or 2^31 splats.
  void draw(std::shared_ptr<const Draw> geometry, const DrawState& state, std::string name = {},
            std::uint32_t first = 0, std::uint32_t splats = ~0U);
  /// Throws UserError for more than 65534 commands, a depth outside [0, 1] and a stencil value beyond 127.
  void clear(Clear clear);

  /// What the stencil holds before the first command, row by row; without, 0. No fast clear is known of then: all is read.
  /// Throws UserError unless there is a value for each pixel.
  void preset_stencil(std::vector<std::uint8_t> values);
  /// Null: all 0.
  const std::vector<std::uint8_t>* stencil_preset() const { return stencil_.get(); }

  /// A clear or a draw.
  struct Command {
    bool is_draw = false;
    DrawIndex draw = 0;
    Clear clear = {};
    bool changes_state = false;  ///< of a draw: the one before has another state
  };
  const std::vector<Command>& commands() const { return commands_; }
  const std::vector<DrawCall>& draws() const { return draws_; }
  const DrawCall& draw_call(DrawIndex draw) const { return draws_[draw]; }
  /// Whether a mark clears all that draws of the frame keep in the depth-stencil target.
  bool clears_depth_stencil(Mark mark) const;
  /// The same frame, of which so many splats, and the commands before the next one's, have been drawn: DRAW goes on behind
  /// them, in a framebuffer that has them.
  Frame gone_on_with(std::uint32_t drawn) const;
  std::uint32_t drawn() const { return drawn_; }  ///< splats
  /// Changes the state of every draw.
  void change_states(const std::function<void(DrawState&)>& change);
  std::uint32_t splats() const { return splats_; }  ///< of all draws
  /// Whether any draw terminates early.
  bool terminates_early() const;
  /// Whether any draw does not blend.
  bool replaces_color() const;
  /// Whether any draw tests depth or stencil after shading.
  bool tests_late() const;
  /// Whether any draw tests depth or stencil: then the depth target has values.
  bool tests_depth_stencil() const;
  /// Whether ZROP does anything for any draw: then all bins pass through it, so that none overtakes another.
  bool needs_zrop() const;

  /// The mark before a command.
  static Mark mark_of(std::size_t command) { return static_cast<Mark>(command + 1); }
  /// The clear that a mark stands for; null for another mark.
  const Clear* clear_of(Mark mark) const;

 private:
  void add(const Command& command);

  std::uint32_t width_;
  std::uint32_t height_;
  DepthFormat depth_format_ = DepthFormat::d24;
  std::uint32_t splats_ = 0;
  std::uint32_t drawn_ = 0;
  std::uint16_t epoch_ = 0;
  std::vector<Command> commands_;
  std::vector<DrawCall> draws_;
  bool has_all_stencil_bits_ = false;  ///< a draw
  std::shared_ptr<const std::vector<std::uint8_t>> stencil_;
};

}  // namespace vrpipe
