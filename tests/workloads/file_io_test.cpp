#include "file_io.h"

#include <sys/stat.h>

#include <array>
#include <thread>

#include <vrpipe/workloads/gaussian_file.h>

#include "workload_test_support.h"

namespace vrpipe {
namespace {

using testing::expect_user_error;
using testing::read_bytes;

void write_all(const std::filesystem::path& path, const std::string& text) {
  AtomicFile file(path, "cannot write file", "--json x");
  file.write(text.data(), text.size());
  file.commit();
}

unsigned mode_of(const std::filesystem::path& path) {
  struct stat status {};
  EXPECT_EQ(::stat(path.c_str(), &status), 0);
  return status.st_mode & 07777U;
}

class InputFiles : public testing::FolderTest {};

TEST_F(InputFiles, AreReadFromAnyPlace) {
  const InputFile file(write("a", "abcdef"), "cannot read scene");
  EXPECT_EQ(file.size(), 6U);
  std::array<char, 3> bytes{};
  file.read(2, bytes.data(), bytes.size());
  EXPECT_EQ(std::string(bytes.data(), bytes.size()), "cde");
  file.check_unchanged();
}

TEST_F(InputFiles, OneThatIsCutShortMeanwhileIsAMistakeNotACrash) {
  const std::filesystem::path path = write("a.ply", std::string(100000, 'x'));
  const InputFile file(path, "cannot read scene");
  std::filesystem::resize_file(path, 10);
  std::vector<char> bytes(100000);
  expect_user_error([&] { file.read(0, bytes.data(), bytes.size()); }, {"cannot read scene", "a.ply", "shorter"});
}

TEST_F(InputFiles, OneThatIsWrittenMeanwhileIsRefused) {
  const std::filesystem::path path = write("a.ply", "old");
  const InputFile file(path, "cannot read scene");
  std::this_thread::sleep_for(std::chrono::milliseconds(20));  // time stamps of files are some milliseconds apart
  write("a.ply", "new");
  expect_user_error([&] { file.check_unchanged(); }, {"a.ply", "written while it was read"});
}

TEST_F(InputFiles, ASceneOutlivesItsFile) {
  const std::filesystem::path path = in_folder("a.ply");
  write_gaussian_file(path, testing::scene_of(std::vector<GaussianAttributes>(500, testing::ordinary_gaussian())));
  const GaussianScene scene = read_gaussian_file(path).gaussians;
  std::filesystem::resize_file(path, 0);
  EXPECT_EQ(scene[499].position()[2], 5.0F);
}

class OutputFiles : public testing::FolderTest {};

TEST_F(OutputFiles, AppearOnlyWhenTheyAreDone) {
  write("a", "old");
  {
    AtomicFile file(in_folder("a"), "cannot write file", "a");
    file.write("new", 3);
  }
  EXPECT_EQ(read_bytes(in_folder("a")), "old");
  EXPECT_EQ(files_in_folder(), 1U);
  write_all(in_folder("a"), "new");
  EXPECT_EQ(read_bytes(in_folder("a")), "new");
  EXPECT_EQ(files_in_folder(), 1U);
}

TEST_F(OutputFiles, AReplacedFileHandsItsModeOn) {
  for (const unsigned mode : {0600U, 0640U, 0666U, 0444U}) {
    const std::filesystem::path path = write("a", "old");
    ::chmod(path.c_str(), mode);
    write_all(path, "new");
    EXPECT_EQ(mode_of(path), mode);
    ::chmod(path.c_str(), 0644);
  }
}

TEST_F(OutputFiles, LinksAreFollowedAlsoToAFileThatIsNotThere) {
  write("there", "old");
  std::filesystem::create_directory(in_folder("folder"));
  std::filesystem::create_symlink("there", in_folder("link"));
  std::filesystem::create_symlink("../folder/../missing", in_folder("folder/dangling"));
  std::filesystem::create_symlink("folder/dangling", in_folder("twice"));
  write_all(in_folder("link"), "new");
  write_all(in_folder("twice"), "new");
  EXPECT_TRUE(std::filesystem::is_symlink(in_folder("link")));
  EXPECT_TRUE(std::filesystem::is_symlink(in_folder("twice")));
  EXPECT_EQ(read_bytes(in_folder("there")), "new");
  EXPECT_EQ(read_bytes(in_folder("missing")), "new");
  std::filesystem::create_symlink("loop", in_folder("loop"));
  expect_user_error([&] { write_all(in_folder("loop"), "new"); }, {"cannot write file", "--json x", "symbolic links"});
}

TEST_F(OutputFiles, NamesMayBeAsLongAsTheFileSystemTakes) {
  const std::string longest(255, 'n');
  write_all(in_folder(longest), "new");
  EXPECT_EQ(read_bytes(in_folder(longest)), "new");
  expect_user_error([&] { write_all(in_folder(longest + "n"), "new"); }, {"too long", "shorter name"});
  EXPECT_EQ(files_in_folder(), 1U);
}

TEST_F(OutputFiles, APipeIsWrittenAsItIs) {
  const std::filesystem::path path = in_folder("pipe");
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  std::string got;
  std::thread reader([&] { got = read_bytes(path); });
  write_all(path, "new");
  reader.join();
  EXPECT_EQ(got, "new");
  EXPECT_TRUE(std::filesystem::is_fifo(path));
}

TEST_F(OutputFiles, APipeIsReachedThroughTheLinkOfItsDescriptor) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  write_all("/dev/fd/" + std::to_string(ends[1]), "new");
  char got[4] = "";
  EXPECT_EQ(::read(ends[0], got, 3), 3);
  EXPECT_STREQ(got, "new");
  ::close(ends[0]);
  ::close(ends[1]);
}

TEST_F(OutputFiles, ASignalHandlerCanRemoveWhatIsNotDone) {
  write("kept", "kept");
  AtomicFile first(in_folder("kept"), "cannot write file", "x");
  first.write("new", 3);
  AtomicFile second(in_folder("other"), "cannot write file", "x");
  EXPECT_EQ(files_in_folder(), 3U);
  remove_unfinished_files();
  EXPECT_EQ(files_in_folder(), 1U);
  EXPECT_EQ(read_bytes(in_folder("kept")), "kept");
}

}  // namespace
}  // namespace vrpipe
