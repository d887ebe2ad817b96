"""Finite elements on a surface: the eigenvalues of its Laplace-Beltrami operator [1/mm^2].

    finite_elements.py                       # a ball, where they are l (l + 1) / r^2
    finite_elements.py ct.nii.gz 86,122,343
"""

import sys

import numpy as np
import scipy.sparse
import scipy.sparse.linalg
import surfseg


def matrices(vertices, faces):
    """Stiffness and lumped mass of P1 elements."""
    n, entries = len(vertices), []
    corners = vertices[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]),
                          axis=1) / 2
    # Edge opposite to each corner: grad phi_i . grad phi_j = e_i . e_j / (4 area^2).
    edges = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
    for i in range(3):
        for j in range(3):
            values = np.einsum("ij,ij->i", edges[:, i], edges[:, j]) / (4 * area)
            entries.append((faces[:, i], faces[:, j], values))
    rows, columns, values = (np.concatenate(e) for e in zip(*entries))
    stiffness = scipy.sparse.csc_matrix((values, (rows, columns)), shape=(n, n))
    mass = np.bincount(faces.ravel(), weights=np.repeat(area / 3, 3), minlength=n)
    return stiffness, scipy.sparse.diags(mass).tocsc()


def eigenvalues(surface, n=9):
    stiffness, mass = matrices(surface.vertices, surface.faces)
    start = np.ones(len(surface.vertices))
    shift = -1e-3 / surface.area_cm2
    return np.sort(scipy.sparse.linalg.eigsh(stiffness, n, mass, sigma=shift, v0=start,
                                             return_eigenvectors=False))


def main(arguments):
    if arguments:
        seed = [float(x) for x in arguments[1].split(",")]
        print(eigenvalues(surfseg.segment(arguments[0], [seed])))
        return
    surface = surfseg.segment(surfseg.phantom("ball", size=64), [(0, 0, 0)], edge_length="1vox")
    radius = 0.6
    computed = eigenvalues(surface) * radius**2
    print("computed", np.round(computed, 3))
    print("exact    [0 2 2 2 6 6 6 6 6]")
    assert np.allclose(computed, [0, 2, 2, 2, 6, 6, 6, 6, 6], rtol=0.02, atol=1e-6)


if __name__ == "__main__":
    main(sys.argv[1:])
