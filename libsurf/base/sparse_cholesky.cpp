#include "libsurf/base/sparse_cholesky.h"

#include <cblas-openblas.h>
#include <cholmod.h>
#include <omp.h>
#include <sys/mman.h>
#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <condition_variable>
#include <limits>
#include <memory>
#include <mutex>
#include <new>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "libsurf/base/memory.h"

// OpenBLAS' own, which its headers do not name.
extern "C" {
[[gnu::weak]] void* blas_memory_alloc(int position);
[[gnu::weak]] void blas_memory_free(void* buffer);
}

namespace surf {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

constexpr Eigen::Index kColumns = 8;  // that are solved for at once

/// CHOLMOD's settings and workspace; each object has its own, so that several threads may factor.
class Common {
 public:
  Common() {
    cholmod_start(&common_);
    common_.supernodal = CHOLMOD_SUPERNODAL;
    common_.final_ll = 1;
    common_.print = 0;
  }
  ~Common() { cholmod_finish(&common_); }
  Common(const Common&) = delete;
  Common& operator=(const Common&) = delete;

  cholmod_common* get() { return &common_; }

 private:
  cholmod_common common_;
};

/// How many may be in OpenBLAS at once. Each caller takes a buffer of 128 MB, most of which is
/// never touched, and where a limit on memory leaves none OpenBLAS asks for it again and again,
/// without end. So under a limit those that can be had are taken before the first call; OpenBLAS
/// keeps them for later ones.
int most_callers() {
  constexpr std::size_t kBuffer = std::size_t(128) << 20, kRest = std::size_t(64) << 20;
  static const int n = [] {
    if (usable_memory() >= machine_memory() || !blas_memory_alloc || !blas_memory_free)
      return std::numeric_limits<int>::max();
    std::vector<void*> buffers;
    while (buffers.size() < std::max(1u, std::thread::hardware_concurrency())) {
      void* const room = ::mmap(nullptr, kBuffer + kRest, PROT_READ | PROT_WRITE,
                                MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
      if (room == MAP_FAILED) break;
      ::munmap(room, kBuffer + kRest);
      buffers.push_back(blas_memory_alloc(0));
    }
    for (void* const buffer : buffers) blas_memory_free(buffer);
    return int(buffers.size());
  }();
  return n;
}

/// Keeps CHOLMOD and OpenBLAS under it to this thread. CHOLMOD's OpenMP teams of four wait for each
/// other at thousands of small supernodes: with another process on the cores locating the edges of
/// a spleen took 3.1 s of wall time for 0.6 s of work, 1.7 so. OpenBLAS' own threads made it 1.9 s
/// for the inside of a skull, not 1.3. Where it was built without any (libopenblas0-serial) two
/// threads in it spoil each other's factors, so that one waits.
class OneThread {
 public:
  OneThread() : levels_(omp_get_max_active_levels()) {
    const int most = most_callers();
    if (most == 0) throw std::bad_alloc();
    omp_set_max_active_levels(0);
    if (openblas_get_parallel() == kSerial) {
      alone_ = std::unique_lock(one_at_a_time_);
      return;
    }
    std::unique_lock lock(counting_);
    one_has_left_.wait(lock, [most] { return n_ < most; });
    if (n_++ > 0) return;
    blas_threads_ = openblas_get_num_threads();
    if (blas_threads_ != 1) openblas_set_num_threads(1);
  }
  ~OneThread() {
    omp_set_max_active_levels(levels_);
    if (alone_.owns_lock()) return;
    const std::lock_guard lock(counting_);
    one_has_left_.notify_one();
    if (--n_ == 0 && blas_threads_ != 1) openblas_set_num_threads(blas_threads_);
  }
  OneThread(const OneThread&) = delete;
  OneThread& operator=(const OneThread&) = delete;

 private:
  static constexpr int kSerial = 0;  // as openblas_get_parallel() says
  static inline std::mutex one_at_a_time_, counting_;
  static inline std::condition_variable one_has_left_;
  static inline int n_ = 0, blas_threads_ = 1;

  int levels_;
  std::unique_lock<std::mutex> alone_;
};

/// Frees what CHOLMOD made.
struct Factor {
  Common common;
  cholmod_factor* L = nullptr;

  ~Factor() { cholmod_free_factor(&L, common.get()); }
  void check() const {
    if (!L) throw std::bad_alloc();
  }
};

/// The matrix as CHOLMOD sees it, without a copy.
cholmod_sparse view_of(const Sparse& matrix) {
  if (!matrix.isCompressed()) throw std::logic_error("SparseCholesky: the matrix is compressed");
  cholmod_sparse out{};
  out.nrow = std::size_t(matrix.rows());
  out.ncol = std::size_t(matrix.cols());
  out.nzmax = std::size_t(matrix.nonZeros());
  out.p = const_cast<int*>(matrix.outerIndexPtr());
  out.i = const_cast<int*>(matrix.innerIndexPtr());
  out.x = const_cast<double*>(matrix.valuePtr());
  out.stype = -1;  // the lower triangle
  out.itype = CHOLMOD_INT;
  out.xtype = CHOLMOD_REAL;
  out.dtype = CHOLMOD_DOUBLE;
  out.sorted = out.packed = 1;
  return out;
}

cholmod_dense view_of(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  cholmod_dense out{};
  out.nrow = out.d = std::size_t(matrix.rows());
  out.ncol = std::size_t(matrix.cols());
  out.nzmax = std::size_t(matrix.size());
  out.x = const_cast<double*>(matrix.data());
  out.xtype = CHOLMOD_REAL;
  out.dtype = CHOLMOD_DOUBLE;
  return out;
}

/// One block of columns of L, its rows in ascending order: those of its own columns first.
struct Supernode {
  Supernode(const cholmod_factor& L, int k)
      : first_column(static_cast<const int*>(L.super)[k]),
        n_columns(static_cast<const int*>(L.super)[k + 1] - first_column),
        rows(static_cast<const int*>(L.s) + static_cast<const int*>(L.pi)[k]),
        n_rows(static_cast<const int*>(L.pi)[k + 1] - static_cast<const int*>(L.pi)[k]),
        values(static_cast<const int*>(L.px)[k]) {}

  int first_column, n_columns;
  const int* rows;
  int n_rows;
  std::ptrdiff_t values;  // where they begin, column by column
};

/// The inverse of L L^T on the nonzeros of L, block by block from the last:
/// with L = (L_JJ, 0; L_RJ, .) and Y = L_RJ L_JJ^-1,
/// Z_RJ = -Z_RR Y, Z_JJ = L_JJ^-T L_JJ^-1 - Y^T Z_RJ.
class InverseOnPattern {
 public:
  explicit InverseOnPattern(const cholmod_factor& L)
      : L_(L), Z_(std::size_t(L.xsize)), supernode_of_(L.n), place_(L.n) {
    for (int k = 0; k < int(L.nsuper); ++k) {
      const Supernode node(L, k);
      for (int j = 0; j < node.n_columns; ++j) supernode_of_[node.first_column + j] = k;
    }
    for (int k = int(L.nsuper) - 1; k >= 0; --k) find(Supernode(L, k));
  }

  Eigen::VectorXd diagonal() const {
    Eigen::VectorXd out(Eigen::Index(L_.n));
    for (int k = 0; k < int(L_.nsuper); ++k) {
      const Supernode node(L_, k);
      for (int j = 0; j < node.n_columns; ++j)
        out[node.first_column + j] =
            Z_[std::size_t(node.values + std::ptrdiff_t(j) * node.n_rows + j)];
    }
    return out;
  }

 private:
  void find(const Supernode& node) {
    const int m = node.n_columns, n_below = node.n_rows - m;
    const Eigen::Map<const Eigen::MatrixXd> block(static_cast<const double*>(L_.x) + node.values,
                                                  node.n_rows, m);
    Eigen::Map<Eigen::MatrixXd> out(Z_.data() + node.values, node.n_rows, m);
    const Eigen::MatrixXd inverse =
        block.topRows(m).triangularView<Eigen::Lower>().solve(Eigen::MatrixXd::Identity(m, m));
    out.topRows(m).noalias() = inverse.transpose() * inverse;
    if (n_below == 0) return;
    const Eigen::MatrixXd Y = block.bottomRows(n_below) * inverse;
    out.bottomRows(n_below).noalias() =
        below(node).selfadjointView<Eigen::Lower>() * Eigen::MatrixXd(-Y);
    out.topRows(m).noalias() -= Y.transpose() * out.bottomRows(n_below);
  }

  /// Z_RR, its lower triangle, from the blocks that are found.
  Eigen::MatrixXd below(const Supernode& node) {
    const int* R = node.rows + node.n_columns;
    const int n = node.n_rows - node.n_columns;
    Eigen::MatrixXd out(n, n);
    for (int first = 0; first < n;) {
      const int k = supernode_of_[R[first]];
      const Supernode later(L_, k);
      for (int row = 0; row < later.n_rows; ++row) place_[later.rows[row]] = row;
      int column = first;
      for (; column < n && supernode_of_[R[column]] == k; ++column) {
        const double* from = Z_.data() + later.values +
                             std::ptrdiff_t(R[column] - later.first_column) * later.n_rows;
        for (int row = column; row < n; ++row) out(row, column) = from[place_[R[row]]];
      }
      first = column;
    }
    return out;
  }

  const cholmod_factor& L_;
  std::vector<double> Z_;
  std::vector<int> supernode_of_, place_;
};

}  // namespace

/// With the factors that are no longer needed, whose memory serves the next ones: where each had
/// its own, the kernel's clearing of fresh pages took a quarter of the time of locating the edges
/// of a brain (41,000 vertices, some 25 factors).
struct CholeskyPattern::Impl : Factor {
  mutable std::mutex mutex;
  mutable std::vector<std::unique_ptr<Factor>> spare;

  std::unique_ptr<Factor> take() const {
    {
      const std::lock_guard lock(mutex);
      if (!spare.empty()) {
        std::unique_ptr<Factor> out = std::move(spare.back());
        spare.pop_back();
        return out;
      }
    }
    auto out = std::make_unique<Factor>();
    out->L = cholmod_copy_factor(L, out->common.get());
    out->check();
    return out;
  }
  void give_back(std::unique_ptr<Factor> factor) const {
    const std::lock_guard lock(mutex);
    spare.push_back(std::move(factor));
  }
};

CholeskyPattern::CholeskyPattern(const Sparse& matrix) {
  const OneThread one;
  const auto impl = std::make_shared<Impl>();
  cholmod_sparse A = view_of(matrix);
  impl->L = cholmod_analyze(&A, impl->common.get());
  impl->check();
  impl_ = impl;
}

struct SparseCholesky::Impl {
  explicit Impl(std::shared_ptr<const CholeskyPattern::Impl> of)
      : pattern(std::move(of)), factor(pattern->take()) {}
  ~Impl() { pattern->give_back(std::move(factor)); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  const cholmod_factor* lower() const { return factor->L; }
  cholmod_common* common() const { return factor->common.get(); }

  std::shared_ptr<const CholeskyPattern::Impl> pattern;
  std::unique_ptr<Factor> factor;
};

SparseCholesky::SparseCholesky(const Sparse& matrix)
    : SparseCholesky(CholeskyPattern(matrix), matrix) {}

SparseCholesky::SparseCholesky(const CholeskyPattern& pattern, const Sparse& matrix)
    : impl_(std::make_unique<Impl>(pattern.impl_)) {
  const OneThread one;
  cholmod_sparse A = view_of(matrix);
  cholmod_factorize(&A, impl_->factor->L, impl_->common());
  if (impl_->common()->status == CHOLMOD_OUT_OF_MEMORY) throw std::bad_alloc();
}

SparseCholesky::SparseCholesky(SparseCholesky&&) noexcept = default;
SparseCholesky& SparseCholesky::operator=(SparseCholesky&&) noexcept = default;
SparseCholesky::~SparseCholesky() = default;

bool SparseCholesky::is_definite() const {
  return impl_->common()->status == CHOLMOD_OK && impl_->lower()->minor == impl_->lower()->n;
}

Eigen::MatrixXd SparseCholesky::solve(const Eigen::MatrixXd& rhs) const {
  if (!is_definite()) throw std::logic_error("SparseCholesky: the matrix is not positive definite");
  Eigen::MatrixXd out(rhs.rows(), rhs.cols());
  const Eigen::Index n_blocks = (rhs.cols() + kColumns - 1) / kColumns;
  tbb::parallel_for(Eigen::Index(0), n_blocks, [&](Eigen::Index block) {
    const OneThread one;
    Common common;
    const Eigen::Index first = block * kColumns, n = std::min(kColumns, rhs.cols() - first);
    cholmod_dense B = view_of(rhs.middleCols(first, n));
    cholmod_dense* X = cholmod_solve(CHOLMOD_A, impl_->factor->L, &B, common.get());
    if (!X) throw std::bad_alloc();
    out.middleCols(first, n) =
        Eigen::Map<const Eigen::MatrixXd>(static_cast<const double*>(X->x), rhs.rows(), n);
    cholmod_free_dense(&X, common.get());
  });
  return out;
}

Eigen::VectorXd SparseCholesky::inverse_diagonal() const {
  if (!is_definite()) throw std::logic_error("SparseCholesky: the matrix is not positive definite");
  const Eigen::VectorXd permuted = InverseOnPattern(*impl_->lower()).diagonal();
  const auto* order = static_cast<const int*>(impl_->lower()->Perm);
  Eigen::VectorXd out(permuted.size());
  for (Eigen::Index k = 0; k < out.size(); ++k) out[order[k]] = permuted[k];
  return out;
}

}  // namespace surf
