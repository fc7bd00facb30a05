#include <filesystem>
#include <iostream>

#include <fmt/format.h>

#include <vrpipe/component/printable.h>
#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/scene.h>
#include <vrpipe/workloads/scene_substitution.h>

#include "cli/command_line.h"
#include "cli/options.h"
#include "host/output_file.h"
#include "output/report.h"

namespace vrpipe::tools {
namespace {

class ConvertCommand : public Command {
 public:
  std::string name() const override { return "convert"; }
  std::string summary() const override { return "a scene in another format"; }

  void declare(Arguments& arguments) override {
    arguments.add_positional("IN", in_, "a file of Gaussians, or builtin:NAME; `vrpipe scenes` lists the formats")
        .is_required = true;
    arguments.add_positional("OUT", out_, "FILE.ply, as INRIA writes it, attributes bit for bit; or FILE.splat")
        .is_required = true;
    arguments.set_footer(
        "Reads any format and writes INRIA's .ply, or .splat, in whose bytes colours and rotations are rounded.\n"
        "\n"
        "Examples:\n"
        "  vrpipe convert scene.sog scene.ply\n"
        "  vrpipe convert folder#lod=2 coarse.ply\n"
        "  vrpipe convert builtin:object object.splat");
  }

  void run() override {
    check_output_file(out_, "OUT");
    check_files_differ({{"IN", gaussian_file_path(scene_file(in_))}}, {{"OUT", out_}});
    const GaussianFile scene = open_gaussians(in_);
    for (const std::string& note : scene.notes) std::cerr << "note: " << printable(note) << "\n";
    for (const std::string& note : write_gaussian_file(out_, scene)) {
      std::cerr << "note: " << printable(note) << "\n";
    }
    std::cout << fmt::format("{}: {} Gaussians, {:.1f} MB\n", printable(out_), grouped(scene.gaussians.size()),
                             static_cast<double>(std::filesystem::file_size(out_)) / 1e6);
  }

 private:
  std::string in_, out_;
};

}  // namespace

std::unique_ptr<Command> make_convert_command() { return std::make_unique<ConvertCommand>(); }

}  // namespace vrpipe::tools
