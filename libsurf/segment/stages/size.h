// How many elements a shape will have, told before they are made.
#pragma once

namespace surf::segment {

/// Elements that a shape has at least whose edges are no longer than this: segments, or equilateral
/// triangles.
/// @param measure  length [mm] or area [mm^2]
template <int Dim>
double least_elements(double measure, double longest_edge_mm);

/// Warns of what will take minutes a step, and refuses what would take days.
/// @param name             of the stage, for the warning
/// @param edge_length_mm   that was asked for; what the message calls Options::edge_length_mm
/// @param longest_edge_mm  where the shape is flat
/// @throws UsageError  with the least edge length that would do
template <int Dim>
void check_elements(const char* name, double measure, double edge_length_mm,
                    double longest_edge_mm);

}  // namespace surf::segment
