// What scenes of many Gaussians cost: time and memory for each, from 0.1 million to 13.6 million of SH degree 3.
//   scene_size [--short] [--full]
// For each size a process of its own writes an INRIA .ply, reads it again while the system still has it in memory,
// preprocesses it for 1280x720, and draws it without time. --full goes up to 13.6 million (a file of 3.4 GB in $TMPDIR),
// else 3 million; --short takes 0.02 million, to see that it works.
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/mixed_frame.h>
#include <vrpipe/workloads/preprocess.h>

namespace vrpipe {
namespace {

/// Small splats in a slab before a camera at the origin, three quarters of them in its view.
GaussianScene generated(std::uint64_t count) {
  GaussianArray scene(count, 3, "generated scene");
  for (std::uint64_t i = 0; i < count; ++i) {
    std::uint64_t state = mix(i);
    const auto next = [&state] {
      state = mix(state);
      return static_cast<float>(state >> 40U) * 0x1p-24F;
    };
    GaussianAttributes gaussian;
    gaussian.position = {(next() - 0.5F) * 20, (next() - 0.5F) * 12, 8 + 4 * next()};
    for (float& scale : gaussian.log_scale) scale = -6 + next();
    for (float& component : gaussian.rotation) component = next() - 0.5F;
    gaussian.opacity_logit = 6 * next() - 2;
    for (float& colour : gaussian.f_dc) colour = 2 * next() - 1;
    for (auto& channel : gaussian.f_rest) {
      for (float& coefficient : channel) coefficient = 0.2F * next() - 0.1F;
    }
    scene.set(i, gaussian);
  }
  return scene.build();
}

class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

double peak_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) * 1024;
}

void measure(std::uint64_t count, const std::filesystem::path& file) {
  constexpr int kRepeat = 3;
  double read = 1e9, preprocessed = 1e9, bytes = 0;
  SceneSummary summary;
  Draw draw;
  for (int i = 0; i < kRepeat; ++i) {
    const Stopwatch reading;
    const GaussianScene scene = read_gaussian_file(file.string()).gaussians;
    read = std::min(read, reading.seconds());
    const Stopwatch preprocessing;
    draw = {};
    draw = preprocess(scene, look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 50, 1280, 720), {}, summary);
    preprocessed = std::min(preprocessed, preprocessing.seconds());
    bytes = peak_bytes();
  }
  RunRequest request;
  request.platform = &platforms().front();
  request.variant = variant_named("het+qm");
  request.fidelity = Fidelity::functional;
  request.reads_statistics = false;
  MixedFrameOptions options;
  options.splats = draw_state_of(request);
  const Stopwatch drawing;
  simulate(request, *mixed_frame(draw, {}, options));
  const double per = 1e9 / static_cast<double>(count);
  std::printf("%10.2f %10.2f %10.3f %12.3f %10.3f %8.0f %12.0f %10.0f %10.0f\n", static_cast<double>(count) / 1e6,
              static_cast<double>(summary.gaussians_visible) / 1e6, read, preprocessed, drawing.seconds(), read * per,
              preprocessed * per, bytes / static_cast<double>(count), peak_bytes() / static_cast<double>(count));
  std::fflush(stdout);
}

/// Runs work() in a process of its own, so that its peak of memory is its own.
template <class Work>
void in_a_process(const Work& work) {
  const pid_t child = fork();
  if (child == 0) {
    try {
      work();
      std::_Exit(0);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "scene_size: %s\n", error.what());
      std::_Exit(1);
    }
  }
  int status = 0;
  waitpid(child, &status, 0);
  if (status != 0) std::exit(1);
}

int run(const std::vector<std::string>& arguments) {
  std::vector<std::uint64_t> counts = {100'000, 300'000, 1'000'000, 3'000'000};
  for (const std::string& argument : arguments) {
    if (argument == "--short") {
      counts = {20'000};
    } else if (argument == "--full") {
      counts.push_back(13'600'000);
    } else {
      const bool help = argument == "--help";
      std::fprintf(help ? stdout : stderr, "usage: scene_size [--short] [--full]\n");
      return help ? 0 : 2;
    }
  }
  std::printf("INRIA .ply of SH degree 3, warm, the best of 3; drawn at functional, het+qm, 1280x720\n");
  std::printf("%10s %10s %10s %12s %10s %8s %12s %10s %10s\n", "Gaussians", "visible", "read", "preprocessed", "drawn",
              "read", "preprocessed", "peak", "and drawn");
  std::printf("%10s %10s %10s %12s %10s %8s %12s %10s %10s\n", "million", "million", "s", "s", "s", "ns each",
              "ns each", "bytes each", "bytes each");
  std::fflush(stdout);
  std::string folder = (std::filesystem::temp_directory_path() / "vrpipe-size-XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) throw std::runtime_error("cannot make a folder for temporary files");
  const std::filesystem::path file = std::filesystem::path(folder) / "scene.ply";
  for (const std::uint64_t count : counts) {
    in_a_process([&] { write_gaussian_file(file, generated(count)); });
    in_a_process([&] { measure(count, file); });
  }
  std::filesystem::remove_all(folder);
  return 0;
}

}  // namespace
}  // namespace vrpipe

int main(int argc, char** argv) {
  try {
    return vrpipe::run(std::vector<std::string>(argv + 1, argv + argc));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "scene_size: %s\n", error.what());
    return 1;
  }
}
