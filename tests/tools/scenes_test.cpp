#include "tool_test_support.h"

#include <cmath>
#include <sstream>

#include <vrpipe/workloads/gaussian_file.h>

namespace vrpipe::testing {
namespace {

/// 300 Gaussians of SH degree 1 in a ball.
GaussianScene ball() {
  GaussianArray scene(300, 1, "test");
  for (unsigned i = 0; i < 300; ++i) {
    GaussianAttributes g;
    g.position = {0.01F * static_cast<float>(i % 17), 0.02F * static_cast<float>(i % 13),
                  0.03F * static_cast<float>(i % 11)};
    g.log_scale = {-3, -3.5F, -4};
    g.opacity_logit = 0.02F * static_cast<float>(i) - 2;
    g.f_dc = {0.5F, 0.1F, -0.2F};
    for (auto& channel : g.f_rest) channel[0] = 0.1F;
    scene.set(i, g);
  }
  return scene.build();
}

class Scenes : public ToolTest {
 protected:
  Scenes() { write_gaussian_file(folder() / "ball.ply", ball()); }
};

TEST_F(Scenes, OfAFileSayWhatIsInIt) {
  const Finished finished = vrpipe({"scenes", "ball.ply"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  for (const char* part :
       {"ball.ply", "INRIA .ply", "300 Gaussians, SH degree 1", "opacity", "scale", "anisotropy", "--eye "}) {
    EXPECT_NE(finished.out.find(part), std::string::npos) << part << " is not in\n" << finished.out;
  }
}

TEST_F(Scenes, TheViewOfAFileCanBeGivenBack) {
  const std::string out = vrpipe({"scenes", "ball.ply"}).out;
  const std::string seen = "seen with ";
  std::istringstream words(out.substr(out.find(seen) + seen.size(), out.find('\n', out.find(seen)) - out.find(seen)));
  std::vector<std::string> command{"run", "--scene", "ball.ply", "--size", "160x120", "--fidelity", "functional"};
  const auto hash = [&] { return json_of(command)["runs"][0]["result_hash"]; };
  const auto automatic = hash();
  for (std::string word; words >> word;) command.push_back(word);
  EXPECT_EQ(command.size(), 7U + 8U);
  EXPECT_EQ(hash(), automatic);
}

TEST_F(Scenes, HaveNumbersAndWordsAsOneWouldWriteThem) {
  const Finished converted = vrpipe({"convert", "ball.ply", "ball.splat"});
  EXPECT_NE((converted.out + converted.err).find("spherical harmonics of degree 1 are left out"), std::string::npos)
      << converted.out << converted.err;
  const Finished drawn = vrpipe({"run", "--scene", "ball.ply", "--size", "32x32", "--fovy", "10", "--fidelity",
                                 "functional", "--html", "ball.html"});
  EXPECT_EQ(drawn.code, 0) << drawn.err;
  EXPECT_NE(read_file(folder() / "ball.html").find(", 10 degrees high"), std::string::npos);
}

TEST_F(Scenes, OfAFileAreInJsonAsWell) {
  const nlohmann::json listed = nlohmann::json::parse(vrpipe({"scenes", "ball.ply", "--json", "-"}).out);
  EXPECT_EQ(listed["schema"], "vrpipe.scene/1");
  EXPECT_EQ(listed["gaussians"], 300);
  EXPECT_EQ(listed["sh_degree"], 1);
  EXPECT_EQ(listed["description"]["opacity"].size(), listed["description"]["percents"].size());
  EXPECT_NEAR(listed["description"]["scale"][0].get<double>(), std::exp(-3.0), 1e-6);
  EXPECT_NEAR(listed["description"]["anisotropy"][0].get<double>(), std::exp(1.0), 1e-5);
  EXPECT_EQ(listed["view"]["up"], nlohmann::json::array({0.0, -1.0, 0.0}));
}

TEST_F(Scenes, AreDrawnAsAPreview) {
  const Finished finished = vrpipe({"scenes", "ball.ply", "--preview", "ball.png"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  const std::string png = read_file(folder() / "ball.png");
  ASSERT_GT(png.size(), 33U);
  EXPECT_EQ(png.substr(1, 3), "PNG");
  const auto side = [&png](std::size_t at) {
    return static_cast<unsigned char>(png[at + 2]) * 256U + static_cast<unsigned char>(png[at + 3]);
  };
  EXPECT_EQ(side(16), 480U);
  EXPECT_EQ(side(20), 270U);
  // A black picture of this size has a few hundred bytes.
  EXPECT_GT(png.size(), 1000U);
}

TEST_F(Scenes, ListTheFormatsThatAreRead) {
  const std::string out = vrpipe({"scenes"}).out;
  const nlohmann::json formats = nlohmann::json::parse(vrpipe({"scenes", "--json", "-"}).out)["formats"];
  EXPECT_EQ(formats.size(), gaussian_formats().size());
  for (const GaussianFormat& format : gaussian_formats())
    EXPECT_NE(out.find(format.name), std::string::npos) << format.name;
  EXPECT_NE(out.find("#lod=VALUE"), std::string::npos);
}

TEST_F(Scenes, ThatCannotBeLookedIntoAreRefused) {
  refused({"scenes", "tiny.spl"}, {"draw list"});
  refused({"scenes", "nowhere.ply"}, {"nowhere.ply", "no such file"});
  refused({"scenes", "--preview", "a.png"}, {"--preview", "no file is named"});
  refused({"scenes", "ball.ply", "--preview", "ball.ply"}, {"--preview", "ball.ply"});
  refused({"scenes", "train=ball.ply", "--preview", "ball.ply"}, {"--preview", "ball.ply"});
  refused({"scenes", "ball.ply", "--preview", "a.png", "--json", "a.png"}, {"--json", "a.png"});
  refused({"scenes", "ball.ply#lod=1"}, {"INRIA .ply", "lod"});
  write_gaussian_file(folder() / "none.ply", GaussianScene());
  refused({"scenes", "none.ply", "--preview", "a.png"}, {"none.ply", "no Gaussian"});
}

class Convert : public Scenes {};

TEST_F(Convert, ToPlyKeepsEveryBit) {
  ASSERT_EQ(vrpipe({"convert", "ball.ply", "again.ply"}).code, 0);
  EXPECT_EQ(read_file(folder() / "again.ply"), read_file(folder() / "ball.ply"));
}

TEST_F(Convert, ToSplatSaysWhatIsLost) {
  const Finished finished = vrpipe({"convert", "ball.ply", "ball.splat"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_EQ(std::filesystem::file_size(folder() / "ball.splat"), 300U * 32);
  EXPECT_NE(finished.out.find("300 Gaussians"), std::string::npos) << finished.out;
  EXPECT_NE(finished.err.find("spherical harmonics"), std::string::npos) << finished.err;
}

TEST_F(Convert, ABuiltInSceneIsOneToo) {
  const Finished finished = vrpipe({"convert", "builtin:object", "object.ply"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_EQ(nlohmann::json::parse(vrpipe({"scenes", "object.ply", "--json", "-"}).out)["description"],
            nlohmann::json::parse(vrpipe({"scenes", "builtin:object", "--json", "-"}).out)["description"]);
}

TEST_F(Convert, RefusesWhatItCannotReadOrWrite) {
  refused({"convert", "tiny.spl", "out.ply"}, {"draw list"});
  refused({"convert", "ball.ply", "out.sog"}, {"out.sog", ".ply or .splat"});
  refused({"convert", "ball.ply", "ball.ply"}, {"ball.ply"});
  refused({"convert", "train=ball.ply", "ball.ply"}, {"ball.ply"});
  refused({"convert", "ball.ply", "nowhere/out.ply"}, {"nowhere"});
  refused({"convert", "ball.ply"}, {"OUT"});
}

}  // namespace
}  // namespace vrpipe::testing
