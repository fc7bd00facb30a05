#pragma once

#include <cstdint>

#include <vrpipe/arithmetic/blend.h>
#include <vrpipe/arithmetic/exp2.h>
#include <vrpipe/pipeline/depth_stencil.h>

namespace vrpipe {

/// What is rasterised for a splat: the oriented box where alpha falls to 1/255, the axis-aligned box of that ellipse, or
/// the oriented box at three sigmas, as two triangles; or that axis-aligned box as one primitive that covers all samples in
/// [left, right) x [top, bottom), as a triangle does with NV_fill_rectangle.
enum class SplatExtent : std::uint8_t { oriented_box, axis_aligned_box, three_sigma, fill_rectangle };

/// The program for a draw's fragments.
enum class FragmentShader : std::uint8_t {
  splat,   ///< a Gaussian's alpha and colour; discards below the pruning threshold
  vertex,  ///< a mesh's interpolated vertex colours
  lit,     ///< the same, lit by a directional light
  none,    ///< nothing is shaded: depth and stencil alone are written
  /// Reads the alpha of the colour target at its pixel and discards where early termination would go on (paper IV-B). Writes
  /// no colour: the stencil alone takes note of what is left.
  alpha_threshold
};
/// Whether fragments read the colour target: then they see all that was blended before their draw.
constexpr bool reads_color(FragmentShader shader) { return shader == FragmentShader::alpha_threshold; }
constexpr bool writes_color(FragmentShader shader) {
  return shader != FragmentShader::none && shader != FragmentShader::alpha_threshold;
}
/// Whether fragments read what is interpolated over their primitive.
constexpr bool reads_attributes(FragmentShader shader) {
  return shader != FragmentShader::none && shader != FragmentShader::alpha_threshold;
}

/// Of the shader `lit`: colour times (ambient + (1 - ambient) max(0, n . l)).
struct Light {
  float x = 0, y = 0, z = 0;  ///< towards the light, of unit length
  float ambient = 1;          ///< 0 to 1
};
bool operator==(const Light& a, const Light& b);

/// Which triangles primitive assembly drops. Those of a mesh whose vertices go counter-clockwise, as one sees them, face the
/// viewer (OpenGL's default); splats and triangles of their own always do.
enum class CullMode : std::uint8_t { none, back, front };

/// What an application sets for a draw through the graphics API, its shaders included.
struct DrawState {
  bool early_termination = false;           ///< HET on: ZROP tests, CROP signals
  float termination_threshold = 0.996F;     ///< alpha, compared in single precision (paper 3.2)
  bool termination_inclusive = true;        ///< >= (paper, alg. 1) rather than > (paper 5.2)
  float pruning_threshold = 1.0F / 255.0F;  ///< fragments with alpha below are excluded from blending
  SplatExtent splat_extent = SplatExtent::oriented_box;
  /// Half axes grow by this many sub-pixel steps, so that snapping loses no fragment at the pruning threshold.
  float obb_padding = 0.75F;
  DepthState depth;
  StencilState stencil;
  bool late_tests = false;  ///< depth and stencil are tested after shading, also where they might be before it
  /// They are tested before it, also where the shader discards: that leaves its trace (GLSL's early_fragment_tests).
  bool early_tests = false;
  CullMode cull = CullMode::none;
  FragmentShader shader = FragmentShader::splat;
  Light light;
  /// Front to back. Without, a fragment takes the place of the pixel's colour, and CROP reads nothing. Such a draw does not
  /// terminate early.
  bool blend = true;

  /// The least alpha that terminates a pixel, in single precision.
  float terminating_alpha() const;
  bool tests_depth_stencil() const { return depth.test || stencil.test; }
  bool writes_depth_stencil() const { return depth.writes() || stencil.writes(); }
  /// Whether the shader may drop fragments.
  bool discards() const {
    return (shader == FragmentShader::splat && pruning_threshold > 0) || shader == FragmentShader::alpha_threshold;
  }
  /// Whether depth and stencil are tested after shading: a fragment that the shader drops leaves no trace in them.
  bool tests_late() const {
    return tests_depth_stencil() && shader != FragmentShader::none && !early_tests &&
           (late_tests || (discards() && writes_depth_stencil()));
  }
  bool tests_early() const { return tests_depth_stencil() && !tests_late(); }
  /// Whether fragments of terminated pixels are dropped before they are shaded. Not where it takes shading to know what they
  /// write: depth and stencil do not depend on termination.
  bool tests_termination() const { return early_termination && !(tests_late() && writes_depth_stencil()); }
  /// Whether two quads of a position may be blended as one (QM). Not where each is tested by itself, after shading.
  bool merges() const { return blend && !tests_late(); }
  /// Whether ZROP reads the depth-stencil target for it, and whether it does so before shading.
  bool reads_depth_stencil() const { return early_termination || tests_depth_stencil(); }
  bool reads_depth_stencil_early() const { return tests_termination() || tests_early(); }
};
bool operator==(const DrawState& a, const DrawState& b);
inline bool operator!=(const DrawState& a, const DrawState& b) { return !(a == b); }

/// In which format numbers are kept, or computed with: single precision, or binary16 after each operation.
enum class NumberFormat : std::uint8_t { fp32, fp16 };
/// How a splat's attributes reach the fragment shader: its centre always in single precision, the 2x2 matrix, opacity and colour in
/// single precision, in binary16, or the matrix in binary16, opacity and colour as UNORM of 8 bits.
enum class AttributeFormat : std::uint8_t { fp32, fp16, quantized };

/// How exactly the hardware computes; no application sets it.
struct DevicePrecision {
  BlendRounding blend_rounding = BlendRounding::rne;
  Exponential exponential = Exponential::ex2;
  NumberFormat shading = NumberFormat::fp32;        ///< from a sample's distance of the centre on
  NumberFormat merging = NumberFormat::fp32;        ///< of two fragments into one (QM)
  NumberFormat export_format = NumberFormat::fp32;  ///< of what the shader sends to be blended
  AttributeFormat attributes = AttributeFormat::fp32;
  float alpha_max = 0.99F;     ///< that the shader clamps alpha to
  unsigned subpixel_bits = 8;  ///< of vertex coordinates (D3D11.3: 8)
};

}  // namespace vrpipe
