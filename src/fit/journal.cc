#include "src/fit/journal.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <span>

#include "src/core/file.h"
#include "src/fit/pack.h"

namespace gapscope {
namespace {

constexpr char kMagic[8] = {'g', 's', 'j', 'o', 'u', 'r', 'n', '2'};
constexpr std::size_t kHead = 16;  // bytes of the magic and the key, and of a record's hash and count

std::span<const double> Span(const Eigen::VectorXd& v) { return {v.data(), static_cast<std::size_t>(v.size())}; }

std::uint64_t HashRecord(Hasher call, const std::vector<double>& record) { return call.Numbers(record).value(); }

}  // namespace

Hasher HashOf(const FitPoint& point, Hasher hasher) {
  hasher.Numbers(Span(point.y));
  for (const auto& state : point.states) hasher.Numbers(Span(state));
  return hasher;
}

Result<std::unique_ptr<Journal>> Journal::Open(const std::string& path, std::uint64_t key, bool resume) {
  std::unique_ptr<Journal> journal(new Journal);
  journal->path_ = path;
  std::size_t good = 0;
  std::error_code failure;
  if (resume && std::filesystem::exists(path, failure)) GS_RETURN_IF_ERROR(journal->Read(key, &good));
  std::filesystem::create_directories(std::filesystem::path(path).parent_path(), failure);
  journal->file_ = std::fopen(path.c_str(), good > 0 ? "r+b" : "wb");
  if (!journal->file_) return Error{.what = "cannot open the journal", .where = path, .actual = std::strerror(errno)};
  if (good == 0) {
    journal->Write(kMagic, sizeof kMagic);
    journal->Write(&key, sizeof key);
    GS_RETURN_IF_ERROR(journal->status_);
  } else if (ftruncate(fileno(journal->file_), static_cast<off_t>(good)) != 0 ||
             std::fseek(journal->file_, 0, SEEK_END) != 0) {
    return Error{.what = "cannot continue the journal", .where = path, .actual = std::strerror(errno)};
  }
  return journal;
}

// Records of the file; `good`: how many of its bytes are whole.
Status Journal::Read(std::uint64_t key, std::size_t* good) {
  GS_ASSIGN(const std::string bytes, ReadFile(path_));
  const bool ours = std::equal(
      bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(std::min(bytes.size(), sizeof kMagic)), kMagic);
  std::uint64_t stored = key;
  if (bytes.size() >= kHead) std::memcpy(&stored, bytes.data() + sizeof kMagic, sizeof stored);
  if (!ours || stored != key) {
    return Error{.what = "the journal belongs to another job",
                 .where = path_,
                 .actual = ours ? "key " + std::to_string(stored) + ", this job's is " + std::to_string(key)
                                : "a file of another kind",
                 .allowed = "the same experiment, model, logs, parameters and options",
                 .cure = "run without --resume"};
  }
  *good = bytes.size() < kHead ? 0 : kHead;  // cut in its head: nothing is lost
  while (*good > 0 && *good + kHead <= bytes.size()) {
    std::uint64_t point = 0, count = 0;
    std::memcpy(&point, bytes.data() + *good, 8);
    std::memcpy(&count, bytes.data() + *good + 8, 8);
    if (count > (bytes.size() - *good - kHead) / 8) break;  // torn by the interruption
    std::vector<double> record(count);
    std::memcpy(record.data(), bytes.data() + *good + kHead, 8 * count);
    records_.emplace_back(point, std::move(record));
    *good += kHead + 8 * count;
  }
  resumed_ = records_.size();
  return Ok();
}

Journal::~Journal() {
  if (file_) std::fclose(file_);
}

bool Journal::IsNext(Hasher call) const {
  return replaying() && records_[next_].first == HashRecord(call, records_[next_].second);
}

bool Journal::Next(Hasher call, std::vector<double>* record) {
  if (!replaying()) return false;
  if (!IsNext(call)) {
    DropRest();  // another path from here on, or a damaged record
    return false;
  }
  *record = records_[next_++].second;
  return true;
}

// What is recorded from here on follows what was handed out.
void Journal::DropRest() {
  records_.resize(next_);
  std::size_t bytes = kHead;
  for (const auto& [hash, numbers] : records_) bytes += kHead + 8 * numbers.size();
  if (ftruncate(fileno(file_), static_cast<off_t>(bytes)) != 0 || std::fseek(file_, 0, SEEK_END) != 0) Fail();
}

Status Journal::Sync() {
  if (status_.ok() && fsync(fileno(file_)) != 0) Fail();
  return status_;
}

void Journal::Fail() {
  if (!status_.ok()) return;
  status_ = Error{.what = "the journal cannot be written",
                  .where = path_,
                  .actual = std::strerror(errno),
                  .cure = "free room there; the run itself goes on, but cannot be resumed from here"};
}

void Journal::Write(const void* bytes, std::size_t size) {
  if (!status_.ok()) return;
  if (std::fwrite(bytes, 1, size, file_) != size || std::fflush(file_) != 0) Fail();
}

void Journal::Append(Hasher call, const std::vector<double>& record) {
  const std::uint64_t head[2] = {HashRecord(call, record), record.size()};
  Write(head, sizeof head);
  Write(record.data(), 8 * record.size());
}

std::vector<double> Pack(const Evaluation& e) {
  std::vector<double> out = {e.cost};
  Put(out, e.work);
  out.insert(out.end(), e.log_costs.begin(), e.log_costs.end());
  return out;
}

Evaluation UnpackEvaluation(const std::vector<double>& numbers) {
  PackReader in(numbers);
  Evaluation e;
  e.cost = in.Number();
  e.work = in.TakeWork();
  e.log_costs.assign(numbers.begin() + 4, numbers.end());
  return e;
}

std::vector<double> Pack(const Linearization& l) {
  std::vector<double> out = {l.cost, l.reduced_cost, l.valid ? 1.0 : 0.0};
  Put(out, l.work);
  out.push_back(static_cast<double>(l.block_gradients.size()));
  out.push_back(static_cast<double>(l.state_gain.size()));
  Put(out, l.hessian);
  Put(out, l.gradient);
  for (const auto& block : l.block_gradients) Put(out, block);
  out.insert(out.end(), l.block_series.begin(), l.block_series.end());
  for (const auto& gain : l.state_gain) Put(out, gain);
  for (const auto& step : l.state_step) Put(out, step);
  return out;
}

Linearization UnpackLinearization(const std::vector<double>& numbers) {
  PackReader in(numbers);
  Linearization l;
  l.cost = in.Number();
  l.reduced_cost = in.Number();
  l.valid = in.Number() != 0;
  l.work = in.TakeWork();
  const std::size_t blocks = in.Count(), windows = in.Count();
  l.hessian = in.Matrix();
  l.gradient = in.Matrix();
  for (std::size_t i = 0; i < blocks; ++i) l.block_gradients.emplace_back(in.Matrix());
  for (std::size_t i = 0; i < blocks; ++i) l.block_series.push_back(static_cast<int>(in.Number()));
  for (std::size_t i = 0; i < windows; ++i) l.state_gain.push_back(in.Matrix());
  for (std::size_t i = 0; i < windows; ++i) l.state_step.emplace_back(in.Matrix());
  return l;
}

}  // namespace gapscope
