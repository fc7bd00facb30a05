#include <sys/stat.h>

#include "forked.h"

namespace vrpipe::testing {
namespace {

/// Names of files: what they may be, and what must not happen to the files.
class Paths : public ToolTest {
 protected:
  /// Refused before anything happens: one line that names `parts`, and every file is as it was.
  void refused(const std::vector<std::string>& arguments, const std::vector<std::string>& parts) const {
    const std::vector<std::string> before = files();
    std::vector<std::string> contents;
    for (const std::string& file : before) contents.push_back(read_file(folder() / file));
    const Finished finished = vrpipe(arguments);
    SCOPED_TRACE(finished.err);
    EXPECT_EQ(finished.code, 2);
    EXPECT_EQ(finished.out, "");
    EXPECT_EQ(std::count(finished.err.begin(), finished.err.end(), '\n'), 1);
    for (const std::string& part : parts) EXPECT_NE(finished.err.find(part), std::string::npos) << part;
    EXPECT_EQ(files(), before);
    for (std::size_t i = 0; i < contents.size(); ++i) EXPECT_EQ(read_file(folder() / before[i]), contents[i]);
  }

  void run_refused(std::vector<std::string> arguments, const std::vector<std::string>& parts) const {
    arguments.insert(arguments.begin(), {"run", "--fidelity", "functional"});
    refused(arguments, parts);
  }
};

TEST_F(Paths, AnOutputIsNeverAnInput) {
  const std::vector<std::string> same{"cannot write file", "is the same file", "name another file"};
  run_refused({"--scene", "tiny.spl", "--save-draw", "tiny.spl"}, same);
  run_refused({"--scene", "tiny.spl", "--json", "../folder/./tiny.spl"}, {"--scene tiny.spl is the same file"});
  write("c.json", "[]");
  run_refused({"--camera", "c.json#3", "--json", "c.json"}, {"(--json c.json): --camera c.json is the same file"});
  refused({"accuracy", "--scene", "tiny.spl", "--html", "tiny.spl"}, same);
  refused({"run", "--scene", "tiny.spl", "--trace", "tiny.spl"}, same);
  refused({"compare", "--scene", "tiny.spl", "--save-draw", "tiny.spl"}, same);
  std::filesystem::create_symlink("tiny.spl", folder() / "link.spl");
  run_refused({"--scene", "tiny.spl", "--json", "link.spl"}, same);
  run_refused({"--scene", "link.spl", "--json", "tiny.spl"}, same);
  std::filesystem::create_hard_link(folder() / "tiny.spl", folder() / "hard.spl");
  run_refused({"--scene", "tiny.spl", "--json", "hard.spl"}, same);
  std::filesystem::create_symlink("tiny.spl", folder() / "tiny-het+qm.png");
  run_refused({"--scene", "tiny.spl", "--output", "."}, {"(--output ./tiny-het+qm.png): --scene tiny.spl"});
}

TEST_F(Paths, AListingIsNeverWrittenOverAPlugin) {
  std::filesystem::copy_file(VRPIPE_PLUGIN_FILE, folder() / "p.so");
  refused({"units", "--plugin", "p.so", "--json", "p.so"}, {"(--json p.so): --plugin p.so is the same file"});
  refused({"platforms", "--plugin", "p.so", "--json", "./p.so"}, {"is the same file"});
  run_refused({"--plugin", "p.so", "--json", "p.so"}, {"is the same file"});
}

TEST_F(Paths, TwoOutputsAreNeverOneFile) {
  run_refused({"--scene", "tiny.spl", "--json", "x", "--save-draw", "./x"}, {"(--save-draw ./x): --json x"});
  refused({"accuracy", "--quick", "--scene", "tiny.spl", "--json", "x", "--html", "x"}, {"is the same file"});
  refused({"run", "--scene", "tiny.spl", "--json", "x", "--trace", "x"}, {"(--trace x): --json x is the same file"});
  run_refused({"--scene", "tiny.spl", "--output", "o", "--json", "o/tiny-het+qm.png"},
              {"--json o/tiny-het+qm.png is the same file"});
  run_refused({"--scene", "tiny.spl", "--variant", "qm", "--output", "o", "--json", "o/../o/tiny-qm.exr"},
              {"is the same file"});
  refused({"accuracy", "--scene", "tiny.spl", "--output", "o", "--json", "o/tiny-reference.png"}, {"is the same file"});
  std::filesystem::create_symlink("x", folder() / "dangling");
  run_refused({"--scene", "tiny.spl", "--json", "dangling", "--save-draw", "x"}, {"is the same file"});
  const Finished device = vrpipe(
      {"run", "--scene", "tiny.spl", "--fidelity", "functional", "--json", "/dev/null", "--save-draw", "/dev/null"});
  EXPECT_EQ(device.code, 0) << device.err;
}

TEST_F(Paths, OnlyJsonGoesToStdout) {
  run_refused({"--scene", "tiny.spl", "--save-draw", "-"}, {"(--save-draw -): only --json can go to stdout", "./-"});
  refused({"accuracy", "--scene", "tiny.spl", "--html", "-"}, {"(--html -): only --json"});
  refused({"run", "--scene", "tiny.spl", "--trace", "-"}, {"(--trace -): only --json"});
  run_refused({"--scene", "tiny.spl", "--output", "-"}, {"(--output -): images cannot go to stdout"});
  EXPECT_EQ(vrpipe({"run", "--scene", "tiny.spl", "--fidelity", "functional", "--save-draw", "./-"}).code, 0);
  EXPECT_EQ(read_file(folder() / "-"), read_file(folder() / "tiny.spl"));
}

TEST_F(Paths, NamesThatNoFileCanHaveAreRefusedFirst) {
  const std::string name(300, 'n');
  run_refused({"--scene", "tiny.spl", "--json", name}, {"File name too long", "give a shorter name"});
  run_refused({"--scene", "tiny.spl", "--output", "o", "--json", "o/" + name}, {"File name too long"});
  run_refused({"--scene", "tiny.spl", "--output", "o/" + name + "/p"}, {"cannot use folder", "File name too long"});
  const std::string scene = std::string(245, 's') + ".spl";
  std::filesystem::copy_file(folder() / "tiny.spl", folder() / scene);
  run_refused({"--scene", scene, "--variant", "baseline", "--output", "o"}, {"baseline.png): File name too long"});
  std::filesystem::create_symlink("loop", folder() / "loop");
  run_refused({"--scene", "tiny.spl", "--json", "loop"}, {"Too many levels of symbolic links"});
  run_refused({"--scene", "tiny.spl", "--output", "loop"}, {"Too many levels of symbolic links"});
  run_refused({"--scene", "tiny.spl", "--output", "loop/o", "--json", "loop/o/r.json"}, {"symbolic links"});
  run_refused({"--scene", "tiny.spl", "--json", "tiny.spl/r.json"}, {"Not a directory"});
  run_refused({"--scene", "tiny.spl", "--json", "r.json/"}, {"it is a folder"});
  run_refused({"--plugin", name}, {"cannot load plugin", "File name too long"});
  run_refused({"--plugin", "loop"}, {"cannot load plugin", "symbolic links"});
  run_refused({"--plugin", "tiny.spl/p.so"}, {"cannot load plugin", "there is no such file"});
  run_refused({"--plugin", "."}, {"cannot load plugin", "not a regular file"});
}

TEST_F(Paths, AFolderThatIsGoneIsAMistake) {
  const std::string scene = (folder() / "tiny.spl").string();
  std::filesystem::create_directory(folder() / "gone");
  const Finished finished = in_fork(folder(), [&] {
    if (::chdir("gone") != 0 || ::rmdir("../gone") != 0) return 97;
    return become_vrpipe({"run", "--scene", scene, "--output", "o", "--json", "o/r.json"});
  });
  EXPECT_EQ(finished.code, 2);
  EXPECT_NE(finished.err.find("No such file or directory"), std::string::npos) << finished.err;
}

TEST_F(Paths, JsonKeepsTheModeOfTheFileAndTheLinkToIt) {
  ::chmod(write("r.json", "old").c_str(), 0600);
  std::filesystem::create_symlink("r.json", folder() / "link.json");
  std::filesystem::create_symlink("new.spl", folder() / "link.spl");
  EXPECT_EQ(vrpipe({"run", "--scene", "tiny.spl", "--fidelity", "functional", "--json", "link.json", "--save-draw",
                    "link.spl"})
                .code,
            0);
  struct stat status {};
  ASSERT_EQ(::stat((folder() / "r.json").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777U, 0600U);
  EXPECT_TRUE(nlohmann::json::accept(read_file(folder() / "r.json")));
  EXPECT_EQ(read_file(folder() / "new.spl"), read_file(folder() / "tiny.spl"));
  EXPECT_TRUE(std::filesystem::is_symlink(folder() / "link.json"));
  EXPECT_TRUE(std::filesystem::is_symlink(folder() / "link.spl"));
}

TEST_F(Paths, ThatAreNotUtf8LoseNoResult) {
  std::filesystem::copy_file(folder() / "tiny.spl", folder() / "caf\xe9.spl");
  const Finished compared = vrpipe(
      {"compare", "--scene", "caf\xe9.spl", "--fidelity", "functional", "--json", "r\xff.json", "--output", "o\xe9"});
  ASSERT_EQ(compared.code, 0) << compared.err;
  const nlohmann::json written = nlohmann::json::parse(read_file(folder() / "r\xff.json"));
  EXPECT_EQ(written["scene"]["name"], "caf\\xE9.spl");
  EXPECT_EQ(written["runs"][0]["images"]["png"], "o\\xE9/caf\\xE9-baseline.png");
  EXPECT_TRUE(std::filesystem::exists(folder() / "o\xe9" / "caf\xe9-baseline.png"));
  EXPECT_TRUE(std::filesystem::exists(folder() / "o\xe9" / "caf\xe9-het+qm.exr"));
  EXPECT_NE(compared.out.find("image: o\\xE9/caf\\xE9-qm.png and .exr"), std::string::npos) << compared.out;
  EXPECT_NE(compared.out.find("result: r\\xFF.json"), std::string::npos) << compared.out;

  const Finished measured = vrpipe({"accuracy", "--quick", "--fidelity", "functional", "--scene", "caf\xe9.spl",
                                    "--json", "a.json", "--html", "a.html"});
  ASSERT_EQ(measured.code, 0) << measured.err;
  EXPECT_EQ(nlohmann::json::parse(read_file(folder() / "a.json"))["scene"]["name"], "caf\\xE9.spl");
  EXPECT_NE(read_file(folder() / "a.html").find("<title>vrpipe accuracy: caf\\xE9.spl"), std::string::npos);
  EXPECT_EQ(read_file(folder() / "a.html").find('\xe9'), std::string::npos);
}

TEST_F(Paths, ForeignBytesDoNotReachTheTerminal) {
  const std::string name = "a\x1b[2J\tb\n\x07.spl";
  std::filesystem::copy_file(folder() / "tiny.spl", folder() / name);
  const Finished run = vrpipe({"run", "--scene", name, "--fidelity", "functional"});
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(run.out.rfind("a\\x1B[2J\\tb\\n\\x07.spl, 48x40: ", 0), 0U) << run.out;
  EXPECT_EQ(vrpipe({"accuracy", "--quick", "--fidelity", "functional", "--scene", name})
                .out.rfind("a\\x1B[2J\\tb\\n\\x07.spl, 48x40: ", 0),
            0U);
  run_refused({"--scene", "\x1b]0;t\x07\xff.spl"}, {"(\\x1B]0;t\\x07\\xFF.spl): no such file"});
  refused({"run", "--fidelity", "\x1b]0;title\x07"}, {"'\\x1B]0;title\\x07'"});
  refused({"run", "--\x1bscene"}, {"'--\\x1Bscene'"});
}

}  // namespace
}  // namespace vrpipe::testing
