function answer = law_tangent(given, c)
% Quantities of a law as functions of overclosure, of which each law has the numbers.
  [~, answer] = law_quantity(given, given.p, given.power_p, c);
end

function [k, t, first] = law_place(given, c)
  c = double(c);
  if ~all(c(:) >= given.c_least & c(:) <= given.c_most)
    error('%s: overclosure must be in [%.17g, %.17g] %s', given.name, given.c_least, given.c_most, given.length);
  end
  [~, k] = histc(given.scale*c(:), [-Inf; given.edges; Inf]);
  x = c(:) - given.h_max*(k > given.side);
  t = (given.scale*x - given.centre(k)).*given.rate(k);
  first = given.ends & k == 1;
  t(first & c(:) <= 0) = 0;
end

% t^power times polynomials, and their derivatives by t
function [value, slope] = law_powered(rows, t, first, power)
  value = rows(:, 9);
  slope = zeros(size(t));
  for j = 8:-1:1
    slope = slope.*t + value;
    value = value.*t + rows(:, j);
  end
  lead = ones(size(t));
  lead(first) = t(first).^power;
  some = first & t > 0;
  slope(some) = slope(some) + power./t(some).*value(some);
  value = lead.*value;
  slope = lead.*slope;
end

function [value, slope] = law_quantity(given, rows, power, c)
  [k, t, first] = law_place(given, c);
  [value, slope] = law_powered(rows(k, :), t, first, power);
  value = reshape(value, size(c));
  slope = reshape(slope.*given.rate(k)*given.scale, size(c));
end

% a quantity with polynomials of its own, and its continuation where bodies are apart
function value = law_curve(given, curve, c)
  law_place(given, c);
  c = double(c);
  inside = min(max(c(:), curve.begin), curve.last);
  if curve.from_contact
    x = curve.scale*inside;
  else
    x = curve.scale*(given.h_max - 2*inside - curve.blocked);
  end
  closed = curve.power > 0 & x <= 0;
  x(closed) = 0;
  [~, k] = histc(x, [-Inf; curve.edges; Inf]);
  % beyond half of the gaps polynomials of a quantity that begins at first contact are of u
  x = x - curve.scale*given.h_max*(k > curve.side);
  t = (x - curve.centre(k)).*curve.rate(k);
  value = law_powered(curve.p(k, :), t, k == 1, curve.power) - curve.offset;
  value(closed) = 0;
  value(closed & c(:) >= curve.unknown_from) = NaN;
  value(c(:) > curve.last) = NaN;
  apart = c(:) < curve.begin;
  u = given.h_max - c(apart);
  if curve.h_rms
    value(apart) = u(:).^3.*(1 - 1.5./((u(:)/curve.h_rms).^2 + 4));
  else
    value(apart) = curve.apart + curve.far./(u(:) + curve.jump);
  end
  value = reshape(value, size(c));
end

function e = law_energy(given, c)
  [k, t, first] = law_place(given, c);
  total = zeros(size(t));
  for j = 9:-1:1
    total = total.*t + given.p(k, j)./(j + given.power_p*first);
  end
  lead = ones(size(t));
  lead(first) = t(first).^given.power_p;
  e = reshape(given.energies(k) + lead.*t.*total./(given.rate(k)*given.scale), size(c));
end

function c = law_overclosure(given, p)
  p = double(p);
  ends = law_quantity(given, given.p, given.power_p, [given.first, given.c_turn]);
  if ~all(p(:) >= ends(1) & p(:) <= ends(2))
    error('%s: pressure must be in [%.17g, %.17g] %s', given.name, ends(1), ends(2), given.stress);
  end
  low = given.first*ones(size(p));
  high = given.c_turn*ones(size(p));
  c = 0.5*(low + high);
  for k = 1:200
    [value, slope] = law_quantity(given, given.p, given.power_p, c);
    below = value < p;
    low(below) = c(below);
    high(~below) = c(~below);
    % Newton's step for the logarithm of pressure: loads range over many decades
    step = value.*log(p./value)./slope;
    if given.ends
      found = c.*exp(step./c);
      near = abs(found - c) <= 4e-16*abs(c);
    else
      found = c + step;
      near = abs(found - c) <= 4e-16*given.h_max;
    end
    bad = ~near & ~(found > low & found < high);
    found(bad) = 0.5*(low(bad) + high(bad));
    c = min(max(found, low), high);
    if all(near(:)), break, end
  end
  c(given.ends & p == 0) = 0;
end
