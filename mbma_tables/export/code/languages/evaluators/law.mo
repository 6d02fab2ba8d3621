package Law "Quantities of a law as functions of overclosure, of which each law has the numbers"
  function piece "The record of x: as many edges are at or below x, and one more"
    input Real x;
    input Real all_edges[:];
    output Integer k;
  algorithm
    k := 1 + sum(if x >= all_edges[i] then 1 else 0 for i in 1:size(all_edges, 1));
  end piece;

  function powered "t^power times a polynomial, and its derivative by t"
    input Real q[9];
    input Real t, power;
    output Real value, slope;
  protected
    Real lead;
  algorithm
    value := q[9];
    slope := 0;
    for j in 8:-1:1 loop
      slope := slope*t + value;
      value := value*t + q[j];
    end for;
    if power > 0 or power < 0 then
      lead := t^power;
      slope := lead*(slope + power/t*value);
      value := lead*value;
    end if;
  end powered;

  function integral "The integral of t^power times a polynomial, from 0 to t"
    input Real q[9];
    input Real t, power;
    output Real value;
  algorithm
    value := 0;
    for j in 9:-1:1 loop
      value := value*t + q[j]/(j + power);
    end for;
    value := (if power > 0 then t^power else 1.0)*t*value;
  end integral;

  function flow_apart "Flow coefficient where bodies are apart"
    input Real u, h_rms;
    output Real y;
  algorithm
    y := u^3*(1 - 1.5/((u/h_rms)^2 + 4));
  end flow_apart;
end Law;
