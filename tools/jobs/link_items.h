#pragma once

#include <string>

#include <vrpipe/pipeline/batch.h>
#include <vrpipe/pipeline/slots/tc.h>
#include <vrpipe/platforms/netlist.h>
#include <vrpipe/platforms/observers.h>
#include <vrpipe/platforms/simulation.h>

namespace vrpipe::tools {

/// The units and links of a request's platform. Throws UserError.
Netlist netlist_of(RunRequest request);

/// Observes a link whatever it carries: `see(passed)` is called for items of any type.
template <class See>
void on_any_item(Observers& observers, const std::string& link, const See& see,
                 const Observers::SeePlaces& see_places = {}) {
  const auto add = [&](auto item) { observers.on_link<decltype(item)>(link, see, see_places); };
  add(VertexWarp{});
  add(PrimitiveItem{});
  add(RasterJob{});
  add(QuadBeat{});
  add(BinItem{});
  add(Warp{});
  add(ShadedWarpItem{});
  add(WarpRelease{});
  add(ColorBeat{});
  add(TerminationBeat{});
  add(HiZUpdate{});
  add(PortReads{});
  add(BlendsDone{});
}

const char* name_of(TcBehaviour::FlushReason reason);

// Items in words.
std::string text_of(const VertexWarp& item);
std::string text_of(const PrimitiveItem& item);
std::string text_of(const RasterJob& item);
std::string text_of(const QuadBeat& item);
std::string text_of(const BinItem& item);
std::string text_of(const Warp& item);
std::string text_of(const ShadedWarpItem& item);
std::string text_of(const WarpRelease& item);
std::string text_of(const ColorBeat& item);
std::string text_of(const TerminationBeat& item);
std::string text_of(const HiZUpdate& item);
std::string text_of(const PortReads& item);
std::string text_of(const BlendsDone& item);

}  // namespace vrpipe::tools
