#pragma once

#include <vrpipe/component/parameter.h>
#include <vrpipe/pipeline/render_context.h>
#include <vrpipe/pipeline/slots/wdx.h>

namespace vrpipe {

/// Of a WDX: one of your own derives its parameters from these.
struct WdxParameters : ParameterSet {
  Integer unit_tiles{
      *this,
      "unit_tiles",
      1,
      1,
      64,
      "screen tiles",
      "VR-Pipe, section 2: a GPC has screen tiles of 16x16 pixels",
      "side of what is given to a GPC as a whole; that of TGC's tile grid, 4, makes each grid one GPC's"};
  Integer primitives_per_cycle{*this,
                               "primitives_per_cycle",
                               2,
                               1,
                               64,
                               "triangles",
                               source::open,
                               "taken from each GPC, and handed to each, in a cycle; matches the rate of VPO"};
  Integer latency_cycles{
      *this, "latency_cycles", 8, 2, 1000, "cycles", source::open, "from the GPC that assembles to the one that owns"};
  Integer credits{*this,
                  "credits",
                  32,
                  1,
                  65536,
                  "triangles",
                  "a vertex batch of 32 triangles (Kenzel et al. 2018, measured on a GTX 1080 Ti)",
                  "from one GPC to another that may wait for their turn"};
};

/// Units of screen tiles go to the entries of a table in turn along a row, and so many entries further in each row; of the
/// entries, to the GPCs in turn.
class TileTable : public WdxBehaviour {
 public:
  unsigned owner_of(TileId tile) const override;
  Timing timing() const override { return timing_; }

 protected:
  /// `entries` is a multiple of the GPCs.
  TileTable(const WdxParameters& parameters, const RenderContext& context, unsigned entries, unsigned row_offset);

 private:
  const unsigned gpcs_;
  const unsigned unit_tiles_;
  const unsigned entries_;
  const unsigned row_offset_;
  const Timing timing_;
};

/// An entry for each GPC: neighbours along rows and down columns belong to different GPCs.
class TileInterleave : public TileTable {
 public:
  struct Parameters : WdxParameters {};
  TileInterleave(const Parameters& parameters, const RenderContext& context);
};

/// An entry for each TPC, with its GPC, as NVIDIA's driver fills it in (nvgpu, init_rop_mapping). All GPCs have as many TPCs,
/// so they come in turn in the table.
class TpcTable : public TileTable {
 public:
  struct Parameters : WdxParameters {
    Integer tpcs_per_gpc{*this, "tpcs_per_gpc", 8, 1, 64, "TPCs", "16 cores, two of them a TPC", "of each GPC"};
    Integer row_offset{*this,
                       "row_offset",
                       0,
                       0,
                       4096,
                       "TPCs",
                       "nvgpu: by the number of TPCs, mostly the smallest odd prime that does not divide it",
                       "from a row of units to the next in the table; 0: the driver's"};
  };
  TpcTable(const Parameters& parameters, const RenderContext& context);
  /// The driver's row offset for a table of so many TPCs.
  static unsigned row_offset_of(unsigned tpcs);
};

}  // namespace vrpipe
