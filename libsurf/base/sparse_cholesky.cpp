#include "libsurf/base/sparse_cholesky.h"

#include <cholmod.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "libsurf/base/detail/one_blas_thread.h"
#include "libsurf/base/detail/supernodes.h"

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

}  // namespace

/// With the factors that are no longer needed, whose memory serves the next ones: where each had
/// its own, the kernel's clearing of fresh pages took a quarter of the time of locating the edges
/// of a brain (41,000 vertices, some 25 factors).
struct CholeskyPattern::Impl : Factor {
  std::optional<SupernodeTree> tree;
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
    cholmod_change_factor(CHOLMOD_REAL, 1, 1, 1, 1, out->L, out->common.get());
    if (out->common.get()->status == CHOLMOD_OUT_OF_MEMORY) throw std::bad_alloc();
    return out;
  }
  void give_back(std::unique_ptr<Factor> factor) const {
    const std::lock_guard lock(mutex);
    spare.push_back(std::move(factor));
  }
};

CholeskyPattern::CholeskyPattern(const Sparse& matrix) {
  const OneBlasThread one;
  const auto impl = std::make_shared<Impl>();
  cholmod_sparse A = view_of(matrix);
  impl->L = cholmod_analyze(&A, impl->common.get());
  impl->check();
  impl->tree.emplace(*impl->L, matrix);
  impl_ = impl;
}

struct SparseCholesky::Impl {
  explicit Impl(std::shared_ptr<const CholeskyPattern::Impl> of)
      : pattern(std::move(of)), factor(pattern->take()) {}
  ~Impl() { pattern->give_back(std::move(factor)); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  const cholmod_factor* lower() const { return factor->L; }
  const SupernodeTree& tree() const { return *pattern->tree; }

  std::shared_ptr<const CholeskyPattern::Impl> pattern;
  std::unique_ptr<Factor> factor;
  bool is_definite = false;
};

SparseCholesky::SparseCholesky(const Sparse& matrix)
    : SparseCholesky(CholeskyPattern(matrix), matrix) {}

SparseCholesky::SparseCholesky(const CholeskyPattern& pattern, const Sparse& matrix)
    : impl_(std::make_unique<Impl>(pattern.impl_)) {
  if (!matrix.isCompressed()) throw std::logic_error("SparseCholesky: the matrix is compressed");
  impl_->is_definite = impl_->tree().factor(matrix, static_cast<double*>(impl_->factor->L->x));
}

SparseCholesky::SparseCholesky(SparseCholesky&&) noexcept = default;
SparseCholesky& SparseCholesky::operator=(SparseCholesky&&) noexcept = default;
SparseCholesky::~SparseCholesky() = default;

bool SparseCholesky::is_definite() const { return impl_->is_definite; }

Eigen::MatrixXd SparseCholesky::solve(const Eigen::MatrixXd& rhs) const {
  if (!is_definite()) throw std::logic_error("SparseCholesky: the matrix is not positive definite");
  Eigen::MatrixXd out(rhs.rows(), rhs.cols());
  const Eigen::Index n_blocks = (rhs.cols() + kColumns - 1) / kColumns;
  tbb::parallel_for(Eigen::Index(0), n_blocks, [&](Eigen::Index block) {
    const OneBlasThread one;
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
  const Eigen::VectorXd permuted =
      impl_->tree().inverse_diagonal(static_cast<const double*>(impl_->lower()->x));
  const auto* order = static_cast<const int*>(impl_->lower()->Perm);
  Eigen::VectorXd out(permuted.size());
  for (Eigen::Index k = 0; k < out.size(); ++k) out[order[k]] = permuted[k];
  return out;
}

}  // namespace surf
