// Quads per second of each behaviour alone, on the quads of a built-in scene.
#include <algorithm>

#include <benchmark/benchmark.h>

#include <vrpipe/pipeline/slots/crop.h>
#include <vrpipe/pipeline/slots/qru.h>
#include <vrpipe/pipeline/slots/raster.h>
#include <vrpipe/pipeline/slots/sm.h>
#include <vrpipe/pipeline/slots/tc.h>
#include <vrpipe/pipeline/slots/tgc.h>
#include <vrpipe/pipeline/slots/vpo.h>
#include <vrpipe/pipeline/slots/zrop.h>
#include <vrpipe/platforms/configuration.h>
#include <vrpipe/workloads/scene.h>

namespace vrpipe {

namespace {

/// A quarter-size frame of the default scene, cut into what each unit takes.
struct Frame {
  LoadedScene scene;
  std::vector<Primitive> primitives;
  std::vector<QuadBeat> tiles;  ///< as RASTER hands them out
  std::vector<QuadBeat> bins;   ///< as TC does
  std::vector<Warp> warps;      ///< of the pairing QRU
  std::vector<ShadedWarp> shaded;
};

RunRequest request_for(ColorFormat format) {
  RunRequest request;
  request.platform = &platforms().front();
  request.variant = variant_named("het+qm");
  request.format = format;
  return request;
}

/// The unit of a slot in the first GPC.
template <class SlotBehaviour>
std::unique_ptr<SlotBehaviour> make_as(const Configuration& configuration, const std::string& slot) {
  const std::vector<Instance>& all = configuration.netlist().instances();
  return configuration.make_as<SlotBehaviour>(
      *std::find_if(all.begin(), all.end(), [&](const Instance& instance) { return instance.slot == slot; }));
}

void cut_bin(const TcBehaviour::Flush& bin, std::vector<QuadBeat>& out) {
  for (std::size_t sent = 0; sent < bin.quads.size();) {
    QuadBeat beat;
    beat.tile = bin.tile;
    beat.count = static_cast<std::uint8_t>(std::min<std::size_t>(bin.quads.size() - sent, QuadBeat::capacity));
    std::copy_n(bin.quads.begin() + static_cast<std::ptrdiff_t>(sent), beat.count, beat.quads.begin());
    sent += beat.count;
    beat.last_of_bin = sent == bin.quads.size();
    out.push_back(beat);
  }
}

const Frame& frame() {
  static const Frame made = [] {
    Frame f;
    SceneRequest scene;
    scene.size = ImageSize{400, 400};
    f.scene = load_scene(scene);
    const Configuration configuration(request_for(ColorFormat::rgba16f), *vrpipe::Frame::of(f.scene.draw));

    const auto vpo = make_as<VpoBehaviour>(configuration, "vpo");
    const auto tgc = make_as<TgcBehaviour>(configuration, "tgc");
    const auto raster = make_as<RasterBehaviour>(configuration, "raster");
    const auto tc = make_as<TcBehaviour>(configuration, "tc");
    TgcBehaviour::Flush grid;
    TcBehaviour::Flush bin;
    const auto rasterize = [&] {
      QuadBeat tile;
      unsigned tests = 0;
      bool new_screen_tile = false;
      for (const Primitive& primitive : grid.primitives) {
        raster->begin(primitive, grid.clip);
        while (raster->next(tile, tests, new_screen_tile)) {
          if (tile.count == 0) continue;
          f.tiles.push_back(tile);
          for (unsigned from = 0; from < tile.count;) {
            bool flushed = false;
            from += tc->insert(tile, from, bin, flushed);
            if (flushed) cut_bin(bin, f.bins);
          }
        }
      }
    };
    std::array<Primitive, 2> visible;
    for (std::uint32_t splat = 0; splat < f.scene.draw.splats.size(); ++splat) {
      const unsigned count = vpo->assemble(0, splat, visible);
      for (unsigned i = 0; i < count; ++i) {
        f.primitives.push_back(visible[i]);
        tgc->begin(visible[i]);
        while (tgc->entering()) {
          if (tgc->step(grid)) rasterize();
        }
      }
    }
    while (tgc->drain(grid)) rasterize();
    while (tc->flush_oldest(TcBehaviour::FlushReason::end_of_draw, bin)) cut_bin(bin, f.bins);

    const auto qru = make_as<QruBehaviour>(configuration, "qru");
    const auto sm = make_as<SmBehaviour>(configuration, "sm");
    const auto shade = [&](const Warp& warp) {
      f.warps.push_back(warp);
      f.shaded.emplace_back();
      sm->shade(warp, f.shaded.back());
    };
    for (const QuadBeat& beat : f.bins) {
      Warp warp;
      bool launched = false;
      for (unsigned from = 0; from < beat.count;) {
        from += qru->examine(beat.tile, &beat.quads[from], beat.count - from, warp, launched);
        if (launched) shade(warp);
      }
      while (beat.last_of_bin && qru->finish_bin(warp)) shade(warp);
    }
    return f;
  }();
  return made;
}

void report_quads(benchmark::State& state, std::uint64_t quads) {
  state.counters["quads_per_second"] =
      benchmark::Counter(static_cast<double>(quads) * static_cast<double>(state.iterations()),
                         benchmark::Counter::kIsRate);
}

std::uint64_t quads_of(const std::vector<QuadBeat>& beats) {
  std::uint64_t sum = 0;
  for (const QuadBeat& beat : beats) sum += beat.count;
  return sum;
}

void rasterize(benchmark::State& state) {
  const Frame& f = frame();
  const Configuration configuration(request_for(ColorFormat::rgba16f), *vrpipe::Frame::of(f.scene.draw));
  std::uint64_t quads = 0;
  for (auto _ : state) {
    const auto raster = make_as<RasterBehaviour>(configuration, "raster");
    quads = 0;
    QuadBeat tile;
    unsigned tests = 0;
    bool new_screen_tile = false;
    for (const Primitive& primitive : f.primitives) {
      raster->begin(primitive, primitive.bounds);
      while (raster->next(tile, tests, new_screen_tile)) quads += tile.count;
    }
  }
  report_quads(state, quads);
}
BENCHMARK(rasterize)->Unit(benchmark::kMillisecond);

void coalesce_tiles(benchmark::State& state) {
  const Frame& f = frame();
  const Configuration configuration(request_for(ColorFormat::rgba16f), *vrpipe::Frame::of(f.scene.draw));
  for (auto _ : state) {
    const auto tc = make_as<TcBehaviour>(configuration, "tc");
    TcBehaviour::Flush bin;
    bool flushed = false;
    for (const QuadBeat& tile : f.tiles) {
      for (unsigned from = 0; from < tile.count;) from += tc->insert(tile, from, bin, flushed);
    }
    benchmark::DoNotOptimize(bin);
  }
  report_quads(state, quads_of(f.tiles));
}
BENCHMARK(coalesce_tiles)->Unit(benchmark::kMillisecond);

void test_termination(benchmark::State& state) {
  const Frame& f = frame();
  const Configuration configuration(request_for(ColorFormat::rgba16f), *vrpipe::Frame::of(f.scene.draw));
  for (auto _ : state) {
    const auto zrop = make_as<ZropBehaviour>(configuration, "zrop");
    for (const QuadBeat& beat : f.bins) {
      QuadBeat tested = beat;
      zrop->test(tested);
      benchmark::DoNotOptimize(tested);
    }
  }
  report_quads(state, quads_of(f.bins));
}
BENCHMARK(test_termination)->Unit(benchmark::kMillisecond);

void reorder_quads(benchmark::State& state) {
  const Frame& f = frame();
  const Configuration configuration(request_for(ColorFormat::rgba16f), *vrpipe::Frame::of(f.scene.draw));
  for (auto _ : state) {
    const auto qru = make_as<QruBehaviour>(configuration, "qru");
    Warp warp;
    bool launched = false;
    for (const QuadBeat& beat : f.bins) {
      for (unsigned from = 0; from < beat.count;)
        from += qru->examine(beat.tile, &beat.quads[from], beat.count - from, warp, launched);
      while (beat.last_of_bin && qru->finish_bin(warp)) benchmark::DoNotOptimize(warp);
    }
  }
  report_quads(state, quads_of(f.bins));
}
BENCHMARK(reorder_quads)->Unit(benchmark::kMillisecond);

void shade_warps(benchmark::State& state) {
  const Frame& f = frame();
  const Configuration configuration(request_for(ColorFormat::rgba16f), *vrpipe::Frame::of(f.scene.draw));
  std::uint64_t quads = 0;
  for (auto _ : state) {
    const auto sm = make_as<SmBehaviour>(configuration, "sm");
    ShadedWarp shaded;
    quads = 0;
    for (const Warp& warp : f.warps) {
      sm->shade(warp, shaded);
      quads += warp.count;
    }
    benchmark::DoNotOptimize(shaded);
  }
  report_quads(state, quads);
}
BENCHMARK(shade_warps)->Unit(benchmark::kMillisecond);

void blend_quads(benchmark::State& state, ColorFormat format) {
  const Frame& f = frame();
  const Configuration configuration(request_for(format), *vrpipe::Frame::of(f.scene.draw));
  std::uint64_t quads = 0;
  for (auto _ : state) {
    ColorSurface surface(f.scene.draw.width, f.scene.draw.height, format);
    const auto crop = make_as<CropBehaviour>(configuration, "crop");
    crop->attach(surface);
    quads = 0;
    for (const ShadedWarp& warp : f.shaded) {
      const std::size_t tile = surface.grid().place(warp.tile, 0);
      for (unsigned i = 0; i < warp.count; ++i) crop->blend(0, tile + warp.position[i], warp.live[i], warp.color[i]);
      quads += warp.count;
    }
  }
  report_quads(state, quads);
}
BENCHMARK_CAPTURE(blend_quads, rgba8, ColorFormat::rgba8)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(blend_quads, rgba16f, ColorFormat::rgba16f)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(blend_quads, rgba32f, ColorFormat::rgba32f)->Unit(benchmark::kMillisecond);

}  // namespace

}  // namespace vrpipe

BENCHMARK_MAIN();
