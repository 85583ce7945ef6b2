// Other programs, run to their end, and a folder for what they write.
#ifndef GAPSCOPE_CORE_CHILD_H_
#define GAPSCOPE_CORE_CHILD_H_

#include <string>
#include <vector>

namespace gapscope {

// A folder of its own that goes with what is in it.
class ScratchFolder {
 public:
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  bool made() const { return made_; }  // false: errno says why
  std::string Path(const char* name) const { return path_ + "/" + name; }

 private:
  std::string path_;
  bool made_ = false;
};

enum class ChildMessages { kShown, kDropped };

// Runs a program without a shell and without input, its stdout into the file `out`; `messages`: its stderr. Its exit
// status; negative: it could not be started (an errno), or did not end by itself.
int RunChild(const std::vector<std::string>& words, const std::string& out,
             ChildMessages messages = ChildMessages::kShown);

}  // namespace gapscope

#endif  // GAPSCOPE_CORE_CHILD_H_
