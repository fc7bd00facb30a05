#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <vrpipe/component/parameter.h>
#include <vrpipe/pipeline/screen_tiling.h>
#include <vrpipe/pipeline/slots/accelerator.h>
#include <vrpipe/pipeline/splat_pixels.h>
#include <vrpipe/pipeline/surface.h>
#include <vrpipe/pipeline/touched_tiles.h>

namespace vrpipe {

/// What presets of a tile accelerator differ in. Parameters are those of GSCore (ASPLOS 2024) where nothing else is said.
struct TileAcceleratorParameters : ParameterSet {
  struct Preset {
    std::uint32_t tile_side = 16;
    std::uint32_t subtile_side = 8;
    unsigned masks = 0;       ///< obb
    unsigned conversion = 0;  ///< of the frame
    std::uint32_t volume_units = 16;
    std::uint32_t pair_bytes = 28;
    double area_mm2 = 3.95;
    double power_watts = 0.87;
    const char* flow_source = "GSCore";
    const char* masks_source = "GSCore";
    const char* units_source = "GSCore: 64 in 4 cores";
    const char* pair_source = "NeRArch-Sim (ISCA 2026): 9.5 MB of 340,000 in a frame; assumed: of a pair";
    const char* area_source = "GSCore, 28 nm: an input";
    const char* power_source = "GSCore, 28 nm: an input";
  };
  explicit TileAcceleratorParameters(const Preset& preset);

  Integer frequency_mhz{*this, "frequency_mhz", 1000, 1, 100000, "MHz", "GSCore", "clock of all units"};
  Integer tile_side_pixels, subtile_side_pixels;
  Choice masks;
  Choice conversion;
  Integer conversion_units{*this,    "conversion_units",
                           4,        1,
                           4096,     "units",
                           "GSCore", "that cull, convert and test against tiles, side by side"};
  Integer conversion_cycles{*this,
                            "conversion_cycles",
                            1,
                            0,
                            65536,
                            "cycles",
                            "assumed: units are pipelined",
                            "of a unit for a Gaussian, culled ones included"};
  Integer test_cycles{*this,
                      "test_cycles",
                      1,
                      0,
                      65536,
                      "cycles",
                      "assumed: units are pipelined",
                      "of a unit for a test of a splat against a tile and its sub-tiles"};
  Integer chunk_entries{*this,
                        "chunk_entries",
                        256,
                        1,
                        65536,
                        "entries",
                        "GSCore: at most",
                        "of a list that are sorted, and then drawn, as one"};
  Integer chunk_buffers{*this, "chunk_buffers", 2, 1, 1024, "chunks", "assumed: double-buffered", "between two stages"};
  Integer quick_sorters{*this, "quick_sorters", 8,        1,
                        4096,  "units",         "GSCore", "that split lists by pivots, an entry a cycle each"};
  Integer quick_ways{*this, "quick_ways", 8,         2,
                     256,   "parts",      "assumed", "that a pass of the quick sorters splits a part of a list into"};
  Integer bitonic_sorters{*this, "bitonic_sorters", 4, 1, 4096, "units", "GSCore", "that sort chunks"};
  Integer bitonic_width{*this, "bitonic_width", 16,       1,
                        4096,  "entries",       "GSCore", "that a bitonic sorter takes at once"};
  Integer bitonic_cycles{*this,
                         "bitonic_cycles",
                         4,
                         1,
                         4096,
                         "cycles",
                         "NeRArch-Sim (ISCA 2026)",
                         "of a bitonic sorter for as many; a chunk takes a round for each doubling of sorted runs"};
  Integer volume_cores{*this, "volume_cores", 4, 1, 1024, "cores", "GSCore", "that draw sub-tiles, side by side"};
  Integer volume_units;
  Real least_transmittance{*this,
                           "least_transmittance",
                           1e-4,
                           0,
                           1,
                           "transmittance",
                           "published kernel",
                           "a pixel stops before the splat that would bring it under this"};
  Integer conversion_latency_cycles{*this,
                                    "conversion_latency_cycles",
                                    128,
                                    0,
                                    1000000,
                                    "cycles",
                                    "NeRArch-Sim (ISCA 2026)",
                                    "through a conversion unit"};
  Integer sort_latency_cycles{*this,
                              "sort_latency_cycles",
                              68,
                              0,
                              1000000,
                              "cycles",
                              "NeRArch-Sim (ISCA 2026): 64 and 4",
                              "through a quick and a bitonic sorter"};
  Integer volume_latency_cycles{
      *this, "volume_latency_cycles", 192, 0, 1000000, "cycles", "NeRArch-Sim (ISCA 2026)", "through a volume unit"};
  Integer sram_kilobytes{*this,
                         "sram_kilobytes",
                         272,
                         1,
                         1000000,
                         "KB",
                         "GSCore: 248 to 272 by account",
                         "on chip; a list that does not fit in half of it is read and written by every quick pass"};
  Real dram_gigabytes_per_second{*this,
                                 "dram_gigabytes_per_second",
                                 51.2,
                                 0.001,
                                 1e6,
                                 "GB/s",
                                 "GSCore: LPDDR4",
                                 "of all that is read and written"};
  Integer gaussian_bytes{*this,
                         "gaussian_bytes",
                         232,
                         0,
                         65536,
                         "bytes",
                         "published format: 58 numbers of 32 bits, harmonics of degree 3",
                         "read of a Gaussian that is converted"};
  Integer culled_bytes{*this,
                       "culled_bytes",
                       12,
                       0,
                       65536,
                       "bytes",
                       "assumed: its position",
                       "read of a Gaussian that is culled or, with conversion by chunks, of all"};
  Integer pair_bytes;
  Integer pixel_bytes{*this, "pixel_bytes", 4, 0, 65536, "bytes", "assumed: 8 bits a channel", "written of a pixel"};
  Real area_mm2, power_watts;
};

/// Lists of splats by tile; of each tile chunks are sorted and drawn until all of its sub-tiles have terminated. GSCore and
/// its kind; a flow that goes Gaussian by Gaussian over all the pixels that it holds has large tiles, and converts chunk by
/// chunk. Pixels stop as in the published renderer, in single precision.
class TileAccelerator : public AcceleratorBehaviour {
 public:
  void use_surfaces(Framebuffer& framebuffer) override;
  std::vector<AcceleratorStep> draw(std::optional<std::uint64_t> gaussians) override;
  /// A fragment is a pixel of a drawn sub-tile that still takes.
  void add_to(Counts& counts, const CountOf& of) const override;
  TimingParameters timing() const override { return timing_; }

  Counter gaussians_converted{*this, "gaussians_converted", "Gaussians",
                              "read whole, once for each chunk they are in with conversion by chunks"};
  Counter tile_tests{*this, "tile_tests", "tests", "of a splat's shape against a tile within its bounds"};
  Counter entries_sorted{*this, "entries_sorted", "entries", "of chunks that are not skipped"};
  Counter entries_drawn{*this, "entries_drawn", "entries", "of these, until the tile has terminated"};
  Counter subtile_pairs_unblended{*this, "subtile_pairs_unblended", "pairs", "drawn, of which no pixel is blended"};
  Counter subtiles_terminated{*this, "subtiles_terminated", "sub-tiles", "of which no pixel takes any more"};
  Counter tiles_terminated{*this, "tiles_terminated", "tiles", "of which no sub-tile does"};
  Counter lists_spilled{*this, "lists_spilled", "lists", "that do not fit in half of the SRAM"};

 protected:
  TileAccelerator(const TileAcceleratorParameters& parameters, const RenderContext& context);

 private:
  enum class Conversion : std::uint8_t { frame, chunk };
  /// Of all tiles, one after the other.
  struct Lists {
    std::vector<std::uint32_t> begin, splats;
  };
  Lists make_lists();
  AcceleratorStep begin_frame(std::uint64_t gaussians) const;
  void draw_tile(std::uint32_t tile, const std::uint32_t* splats, std::uint32_t length,
                 std::vector<AcceleratorStep>& steps);
  AcceleratorStep::Part sort_tile(std::uint32_t length);
  AcceleratorStep::Part sort_chunk(std::uint32_t length) const;
  AcceleratorStep::Part draw_chunk(const std::uint32_t* splats, std::uint32_t length);
  bool draw_in_subtile(const SplatRecord& splat, std::size_t subtile);
  void begin_tile(std::uint32_t tile);
  void store_tile() const;
  std::size_t subtile_of(std::uint32_t x, std::uint32_t y) const;

  const RenderContext& context_;
  const std::uint32_t width_, height_;
  const std::uint32_t tile_side_, subtile_side_;
  const std::uint32_t tiles_x_, tiles_y_;
  const std::uint32_t subtiles_side_;  ///< of a tile
  const std::size_t vectors_;          ///< of a sub-tile: eight pixels each
  const TouchedTiles touched_tiles_, touched_subtiles_;
  const Conversion conversion_;
  const std::uint64_t conversion_units_, conversion_cycles_, test_cycles_;
  const std::uint32_t chunk_entries_;
  const std::uint64_t quick_sorters_, quick_ways_, bitonic_sorters_, bitonic_width_, bitonic_cycles_;
  const std::uint32_t volume_cores_;
  const std::uint64_t pair_cycles_;  ///< of a core, for a splat in a sub-tile
  const float least_transmittance_, pruning_threshold_;
  const std::uint64_t sram_bytes_, gaussian_bytes_, culled_bytes_, pair_bytes_, pixel_bytes_;
  const TimingParameters timing_;
  std::vector<SplatRecord> records_;
  ColorSurface* color_ = nullptr;
  bool converts_ = false;
  std::uint64_t fragments_looked_at_ = 0, fragments_visible_ = 0;

  // Of the tile that is drawn.
  PixelRect subtiles_;               ///< its own, numbered over the image
  std::vector<SplatPixels> pixels_;  ///< sub-tile by sub-tile
  std::vector<std::uint8_t> is_living_;
  std::uint32_t living_ = 0;
  std::vector<std::uint64_t> core_cycles_;
};

/// GSCore (Lee et al., ASPLOS 2024).
class Gscore : public TileAccelerator {
 public:
  struct Parameters : TileAcceleratorParameters {
    Parameters();
  };
  Gscore(const Parameters& parameters, const RenderContext& context) : TileAccelerator(parameters, context) {}
};

/// A flow as GCC's (Pei et al., arXiv 2507.15300): Gaussian by Gaussian over all that a large buffer holds of the image,
/// converted when they are needed.
class Gcc : public TileAccelerator {
 public:
  struct Parameters : TileAcceleratorParameters {
    Parameters();
  };
  Gcc(const Parameters& parameters, const RenderContext& context) : TileAccelerator(parameters, context) {}
};

/// After FLICKER (Ou et al., arXiv 2603.01158): half of the volume units, and masks that are finer.
class Flicker : public TileAccelerator {
 public:
  struct Parameters : TileAcceleratorParameters {
    Parameters();
  };
  Flicker(const Parameters& parameters, const RenderContext& context) : TileAccelerator(parameters, context) {}
};

}  // namespace vrpipe
