# SPDX-License-Identifier: Apache-2.0
"""Planning of single motions of one arm, plans of manipulations, and alternatives that are tried in order."""
