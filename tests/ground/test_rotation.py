"""The sign conventions, against the matrix exponential."""

import itertools

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm

from rom import rotation


@pytest.fixture
def vectors():
    rng = np.random.default_rng(1)
    return [rng.normal(size=3) for _ in range(20)] + [np.zeros(3), np.array([np.pi, 0, 0])]


def test_skew_is_the_cross_product(vectors):
    for a, b in itertools.pairwise(vectors):
        assert_allclose(rotation.skew(a) @ b, np.cross(a, b))
        assert_allclose(rotation.axial(rotation.skew(a)), a)


def test_exp_matrix_and_log_agree_with_the_matrix_exponential(vectors):
    for theta in vectors:
        p = rotation.exp(theta)
        assert_allclose(rotation.matrix(p), expm(rotation.skew(theta)), atol=1e-14)
        back = rotation.matrix(rotation.exp(rotation.log(p)))
        assert_allclose(back, rotation.matrix(p), atol=1e-14)


def test_quaternion_is_found_for_every_largest_component():
    for theta in [*(np.eye(3) * 3.0).tolist(), [0.1, 0.2, 0.3], [0, 0, 0]]:
        A = expm(rotation.skew(theta))
        assert_allclose(rotation.matrix(rotation.quaternion(A)), A, atol=1e-14)


def test_product_of_quaternions_is_product_of_matrices(vectors):
    for a, b in itertools.pairwise(vectors):
        p, q = rotation.exp(a), rotation.exp(b)
        product = rotation.matrix(rotation.multiply(p, q))
        assert_allclose(product, rotation.matrix(p) @ rotation.matrix(q), atol=1e-14)
