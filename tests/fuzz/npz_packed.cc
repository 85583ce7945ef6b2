// Damage to an archive is found by its checksums. Here it is done to the arrays, which are packed behind right ones:
// the input is NAME:ARRAY|||NAME:ARRAY..., every second one deflated.
#include "src/log/npz_reader.h"
#include "tests/fuzz/log_way.h"
#include "tests/log/npz_fixture.h"

FUZZ_TARGET(npz_packed) {
  using namespace gapscope;
  constexpr std::string_view kBetween = "|||";
  std::string_view rest = fuzz::Text(data, size);
  std::vector<Member> members;
  while (!rest.empty()) {
    const std::string_view member = rest.substr(0, rest.find(kBetween));
    const std::size_t name = std::min(member.find(':'), member.size());
    const std::size_t array = std::min(name + 1, member.size());
    members.push_back({std::string(member.substr(0, name)), std::string(member.substr(array)), members.size() % 2 > 0});
    rest.remove_prefix(std::min(member.size() + kBetween.size(), rest.size()));
  }
  fuzz::TakeLog(ReadNpz("log.npz", Zip(members)), "log.npz");
  return 0;
}
