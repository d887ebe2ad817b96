// Noise that cells of an image have in common.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "libsurf/segment/detail/edge_cells.h"

namespace surf::segment {

/// 1 + the sum of the correlations of the residuals of cells up to two apart along each axis, at
/// least 1: so many cells tell as much as one with noise of its own.
/// @param residuals  of the cells by place, in deviations; beyond 4 they count as 4
/// @param size       of the image
template <int Dim>
double noise_correlation(const EdgeCells<Dim>& cells, const std::vector<double>& residuals,
                         const std::array<int, Dim>& size);

/// Halves of the cells of an image at random, to choose by one what is judged by the other: single
/// cells where each has noise of its own, else blocks of 3 along each axis, which are hardly alike
/// by noise. Halves of single cells agreed on what was noise in both of them, and streaks of a CT
/// were followed as if they were edges.
/// @param index        of the cell, first axis fastest
/// @param correlation  noise_correlation()
template <int Dim>
bool is_in_first_half(std::uint64_t index, const std::array<int, Dim>& size, double correlation);

}  // namespace surf::segment
