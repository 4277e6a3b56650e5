# SPDX-License-Identifier: Apache-2.0
"""Finding hands and their landmarks in an image: MediaPipe, closer looks, noise and motion."""
