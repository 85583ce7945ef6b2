#include "src/tune/journal.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "src/core/file.h"

namespace gapscope {
namespace {

constexpr char kMagic[8] = {'g', 's', 'j', 'o', 'u', 'r', 'n', '1'};

std::uint64_t HashPoint(const FitPoint& point) {
  std::uint64_t hash = Hash(point.y.data(), sizeof(double) * static_cast<std::size_t>(point.y.size()));
  for (const auto& state : point.states)
    hash = Hash(state.data(), sizeof(double) * static_cast<std::size_t>(state.size()), hash);
  return hash;
}

void Put(std::vector<double>& out, const Eigen::MatrixXd& matrix) {
  out.push_back(static_cast<double>(matrix.rows()));
  out.push_back(static_cast<double>(matrix.cols()));
  out.insert(out.end(), matrix.data(), matrix.data() + matrix.size());
}

Eigen::MatrixXd Take(const std::vector<double>& in, std::size_t& at) {
  const auto rows = static_cast<Eigen::Index>(in.at(at)), columns = static_cast<Eigen::Index>(in.at(at + 1));
  GS_CHECK(rows >= 0 && columns >= 0 && at + 2 + static_cast<std::size_t>(rows * columns) <= in.size());
  const Eigen::MatrixXd matrix = Eigen::Map<const Eigen::MatrixXd>(in.data() + at + 2, rows, columns);
  at += 2 + static_cast<std::size_t>(rows * columns);
  return matrix;
}

}  // namespace

std::uint64_t Hash(const void* bytes, std::size_t size, std::uint64_t seed) {
  const auto* byte = static_cast<const unsigned char*>(bytes);
  for (std::size_t i = 0; i < size; ++i) seed = (seed ^ byte[i]) * 1099511628211ull;
  return seed;
}

Result<std::unique_ptr<Journal>> Journal::Open(const std::string& path, std::uint64_t key, bool resume) {
  std::unique_ptr<Journal> journal(new Journal);
  std::size_t good = 0;
  std::error_code failure;
  if (resume && std::filesystem::exists(path, failure)) {
    GS_ASSIGN(const std::string bytes, ReadFile(path));
    std::uint64_t stored =
        bytes.size() < 16 &&
                std::equal(bytes.begin(),
                           bytes.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(8, bytes.size())), kMagic)
            ? key
            : 0;
    if (bytes.size() >= 16 && std::memcmp(bytes.data(), kMagic, 8) == 0) std::memcpy(&stored, bytes.data() + 8, 8);
    if (stored != key) {
      return Error{.what = "the journal belongs to another job",
                   .where = path,
                   .actual = "",
                   .allowed = "the same experiment, logs and options",
                   .cure = "run without --resume"};
    }
    good = bytes.size() < 16 ? 0 : 16;  // cut in its head: nothing is lost
    while (good > 0 && good + 16 <= bytes.size()) {
      std::uint64_t point = 0, count = 0;
      std::memcpy(&point, bytes.data() + good, 8);
      std::memcpy(&count, bytes.data() + good + 8, 8);
      if (count > (bytes.size() - good - 16) / 8) break;  // torn by the interruption
      std::vector<double> record(count);
      std::memcpy(record.data(), bytes.data() + good + 16, 8 * count);
      journal->records_.emplace_back(point, std::move(record));
      good += 16 + 8 * count;
    }
    journal->resumed_ = journal->records_.size();
  }
  std::filesystem::create_directories(std::filesystem::path(path).parent_path(), failure);
  journal->file_ = std::fopen(path.c_str(), good > 0 ? "r+b" : "wb");
  if (!journal->file_) return Error{.what = "cannot open the journal", .where = path, .actual = std::strerror(errno)};
  if (good > 0) {
    if (ftruncate(fileno(journal->file_), static_cast<off_t>(good)) != 0)
      return Error{.what = "cannot continue the journal", .where = path, .actual = std::strerror(errno)};
    std::fseek(journal->file_, 0, SEEK_END);
  } else {
    std::fwrite(kMagic, 1, 8, journal->file_);
    std::fwrite(&key, 1, 8, journal->file_);
    std::fflush(journal->file_);
  }
  return journal;
}

Journal::~Journal() {
  if (file_) std::fclose(file_);
}

bool Journal::Next(const FitPoint& point, std::vector<double>* record) {
  if (next_ >= records_.size()) return false;
  const auto& numbers = records_[next_].second;
  if (records_[next_].first != Hash(numbers.data(), sizeof(double) * numbers.size(), HashPoint(point))) {
    records_.resize(next_);  // another path from here on, or a damaged record
    return false;
  }
  *record = records_[next_++].second;
  return true;
}

void Journal::Append(const FitPoint& point, const std::vector<double>& record) {
  const std::uint64_t head[2] = {Hash(record.data(), sizeof(double) * record.size(), HashPoint(point)), record.size()};
  std::fwrite(head, 8, 2, file_);
  std::fwrite(record.data(), 8, record.size(), file_);
  std::fflush(file_);
}

std::vector<double> Pack(const Linearization& l) {
  std::vector<double> out = {l.cost, l.valid ? 1.0 : 0.0, static_cast<double>(l.block_gradients.size()),
                             static_cast<double>(l.state_gain.size())};
  Put(out, l.hessian);
  Put(out, l.gradient);
  for (const auto& block : l.block_gradients) Put(out, block);
  out.insert(out.end(), l.block_logs.begin(), l.block_logs.end());
  for (const auto& gain : l.state_gain) Put(out, gain);
  for (const auto& step : l.state_step) Put(out, step);
  return out;
}

Linearization Unpack(const std::vector<double>& in) {
  Linearization l;
  l.cost = in.at(0);
  l.valid = in.at(1) != 0;
  std::size_t at = 4;
  l.hessian = Take(in, at);
  l.gradient = Take(in, at);
  for (int i = 0; i < static_cast<int>(in[2]); ++i) l.block_gradients.push_back(Take(in, at));
  for (int i = 0; i < static_cast<int>(in[2]); ++i) l.block_logs.push_back(static_cast<int>(in.at(at++)));
  for (int i = 0; i < static_cast<int>(in[3]); ++i) l.state_gain.push_back(Take(in, at));
  for (int i = 0; i < static_cast<int>(in[3]); ++i) l.state_step.push_back(Take(in, at));
  return l;
}

}  // namespace gapscope
