#include "src/diagnose/diagnosis_journal.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "src/core/file.h"
#include "src/fit/pack.h"

namespace gapscope {
namespace {

constexpr const char* kCalls = "calls.bin";

template <class T>
void PutAll(std::vector<double>& out, const std::vector<T>& all) {
  out.push_back(static_cast<double>(all.size()));
  for (const auto& one : all) Put(out, one);
}

template <class T>
std::vector<T> TakeAll(PackReader& in) {
  std::vector<T> all(in.Count());
  for (auto& one : all) one = in.Matrix();
  return all;
}

std::vector<double> Pack(const Derivatives& d) {
  std::vector<double> out = {d.valid ? 1.0 : 0.0};
  Put(out, d.work);
  PutAll(out, d.residuals);
  PutAll(out, d.jacobians);
  return out;
}

Derivatives UnpackDerivatives(const std::vector<double>& numbers) {
  PackReader in(numbers);
  Derivatives d;
  d.valid = in.Number() != 0;
  d.work = in.TakeWork();
  d.residuals = TakeAll<Eigen::VectorXd>(in);
  d.jacobians = TakeAll<Eigen::MatrixXd>(in);
  return d;
}

std::vector<double> Pack(const SolveResult& s) {
  std::vector<double> out = {s.cost, static_cast<double>(s.termination), static_cast<double>(s.iterations)};
  Put(out, s.work);
  Put(out, s.point.y);
  PutAll(out, s.point.states);
  return out;
}

SolveResult UnpackSolve(PackReader& in) {
  SolveResult s;
  s.cost = in.Number();
  s.termination = static_cast<Termination>(in.Count());
  s.iterations = static_cast<int>(in.Number());
  s.work = in.TakeWork();
  s.point.y = in.Matrix();
  s.point.states = TakeAll<Eigen::VectorXd>(in);
  return s;
}

std::vector<double> Pack(const GramSystem& g) {
  std::vector<double> out = {g.valid ? 1.0 : 0.0};
  Put(out, g.work);
  out.push_back(static_cast<double>(g.failed.size()));
  out.insert(out.end(), g.failed.begin(), g.failed.end());
  out.push_back(static_cast<double>(g.half_seconds));
  PutAll(out, g.parts);
  return out;
}

GramSystem UnpackGram(const std::vector<double>& numbers) {
  PackReader in(numbers);
  GramSystem g;
  g.valid = in.Number() != 0;
  g.work = in.TakeWork();
  g.failed.resize(in.Count());
  for (char& failed : g.failed) failed = static_cast<char>(in.Number());
  g.half_seconds = in.Count();
  g.parts = TakeAll<Eigen::MatrixXd>(in);
  return g;
}

std::uint64_t HashOfNumbers(const std::vector<double>& numbers) { return Hasher().Numbers(numbers).value(); }

// To the disk itself: what points to the file may be there before it otherwise.
Status WriteToDisk(const std::string& path, std::uint64_t head, const std::vector<double>& numbers) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  bool good = file && std::fwrite(&head, sizeof head, 1, file) == 1 &&
              std::fwrite(numbers.data(), 8, numbers.size(), file) == numbers.size() && std::fflush(file) == 0 &&
              fsync(fileno(file)) == 0;
  const int problem = errno;
  if (file && std::fclose(file) != 0) good = false;
  if (good) return Ok();
  return Error{.what = "the journal cannot be written",
               .where = path,
               .actual = std::strerror(problem),
               .cure = "free room there; the run itself goes on, but can only be resumed from before this"};
}

}  // namespace

std::string DiagnosisJournal::FolderIn(const std::string& out) {
  return (std::filesystem::path(out) / "diagnosis.journal").string();
}

void DiagnosisJournal::Remove(const std::string& folder) {
  std::error_code failure;  // what stays is overwritten by the next run
  std::filesystem::remove_all(folder, failure);
}

Result<std::unique_ptr<DiagnosisJournal>> DiagnosisJournal::Open(Job job) {
  const std::string path = (std::filesystem::path(job.folder) / kCalls).string();
  std::error_code failure;
  const bool there = std::filesystem::exists(path, failure);
  if (!job.resume) Remove(job.folder);
  std::unique_ptr<DiagnosisJournal> journal(new DiagnosisJournal(std::move(job)));
  if (journal->job_.resume && !there)
    journal->Warn("nothing to resume in " + journal->job_.folder + ": from the start");
  GS_ASSIGN(journal->calls_, Journal::Open(path, journal->job_.key, journal->job_.resume));
  return journal;
}

void DiagnosisJournal::Warn(const std::string& text) {
  if (job_.warn) job_.warn(text);
}

bool DiagnosisJournal::Stopped() {
  stopped_ = stopped_ || !calls_->status().ok() || !large_.ok() || (!replaying() && IsLate(job_.deadline));
  for (const Status& status : {calls_->status(), large_}) {
    if (!status.ok() && !std::exchange(warned_, true)) Warn(status.error().Text());
  }
  return stopped_;
}

bool DiagnosisJournal::Take(const Hasher& call, Numbers* numbers) {
  ++count_;
  const bool before = replaying();
  if (calls_->Next(call, numbers)) return true;
  if (before) {
    Warn("the journal in " + job_.folder + " is damaged: what follows call " + std::to_string(count_) +
         " is computed again, and may differ in last digits");
  }
  return false;
}

void DiagnosisJournal::Record(const Hasher& call, const Numbers& numbers) {
  if (Stopped()) return;
  calls_->Append(call, numbers);
  Stopped();  // says so at once
}

std::string DiagnosisJournal::File(std::size_t number) const {
  return (std::filesystem::path(job_.folder) / (std::to_string(number) + ".bin")).string();
}

void DiagnosisJournal::WriteLarge(std::size_t number, const Numbers& numbers) {
  if (!Stopped()) large_ = WriteToDisk(File(number), HashOfNumbers(numbers), numbers);
}

bool DiagnosisJournal::ReadLarge(std::size_t number, Numbers* numbers) {
  const auto bytes = ReadFile(File(number));
  if (bytes.ok() && bytes.value().empty()) return false;
  std::uint64_t hash = 0;
  if (bytes.ok() && bytes.value().size() >= sizeof hash) {
    std::memcpy(&hash, bytes.value().data(), sizeof hash);
    numbers->resize(bytes.value().size() / 8 - 1);
    std::memcpy(numbers->data(), bytes.value().data() + sizeof hash, 8 * numbers->size());
    if (HashOfNumbers(*numbers) == hash) return true;
  }
  Warn(File(number) + " is missing or damaged: the result may differ in last digits");
  return false;
}

void DiagnosisJournal::Forget(std::size_t number) {
  // All that was made with them must be on the disk before.
  if (Stopped() || (!replaying() && !calls_->Sync().ok())) return;
  std::error_code failure;  // what stays takes room, no more
  std::filesystem::resize_file(File(number), 0, failure);
}

std::shared_ptr<const Derivatives> DiagnosisJournal::Kept(std::size_t number,
                                                          const std::shared_ptr<const Derivatives>& derivatives) {
  const Derivatives* plain = derivatives.get();
  return {plain, [this, number, derivatives](const Derivatives*) { Forget(number); }};
}

SolveResult DiagnosisJournal::Solve(const std::string& call, const FitPoint& start, double keep_below,
                                    const std::function<SolveResult()>& make) {
  const Hasher hash = HashOf(start, Hasher().Text(call));
  if (Numbers numbers; Take(hash, &numbers)) {
    PackReader in(numbers);
    const bool large = in.Number() != 0;
    SolveResult result = UnpackSolve(in);
    if (Numbers kept; large && ReadLarge(count_, &kept))
      result.derivatives = Kept(count_, std::make_shared<const Derivatives>(UnpackDerivatives(kept)));
    return result;
  }
  const std::size_t number = count_;
  SolveResult result = make();
  const bool large = result.derivatives && result.cost < keep_below;
  if (large) WriteLarge(number, Pack(*result.derivatives));
  Numbers numbers = {large ? 1.0 : 0.0};
  for (const double n : Pack(result)) numbers.push_back(n);
  Record(hash, numbers);
  if (large) result.derivatives = Kept(number, result.derivatives);
  return result;
}

Evaluation DiagnosisJournal::Evaluate(const std::string& call, const FitPoint& point,
                                      const std::function<Evaluation()>& make) {
  const Hasher hash = HashOf(point, Hasher().Text(call));
  if (Numbers numbers; Take(hash, &numbers)) return UnpackEvaluation(numbers);
  Evaluation result = make();
  Record(hash, gapscope::Pack(result));
  return result;
}

GramSystem DiagnosisJournal::Gram(const std::string& call, const FitPoint& point, std::vector<std::string> columns,
                                  const std::function<GramSystem()>& make) {
  Hasher hash = HashOf(point, Hasher().Text(call));
  for (const auto& column : columns) hash.Text(column);
  if (Numbers numbers; Take(hash, &numbers)) {
    Numbers kept;
    if (!ReadLarge(count_, &kept)) return make();
    GramSystem result = UnpackGram(kept);
    result.columns = std::move(columns);
    result.parameters = point.y.size();
    return result;
  }
  const std::size_t number = count_;
  GramSystem result = make();
  WriteLarge(number, Pack(result));
  Record(hash, {});
  return result;
}

}  // namespace gapscope
